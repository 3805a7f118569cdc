#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of blending, front to back. With R = (what is blended behind a splat) . dL/dC,
// dL/d(alpha) = T c . dL/dC - R / (1 - alpha). R starts as C . dL/dC, and each splat subtracts its own share.
// So no value is divided by 1 - alpha again and again.
// One workgroup is one subgroup and owns one tile; with SPEC_QUADS it is four, and owns a quad. It reads the sorted splats, their
// records, the image planes and dL/d(image). It writes the gradient slots of the instances, each slot once, in the order of
// SPEC_SLOTS. SPEC_MODE: BLEND_BACKWARD_* bits.
#extension GL_GOOGLE_include_directive : require
#define BINDING_INDICES 6
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool ABSOLUTE = (MODE & BLEND_BACKWARD_ABSOLUTE) != 0u;
const bool WITH_ALPHA = (MODE & BLEND_BACKWARD_ALPHA) != 0u, WITH_FOURTH = (MODE & BLEND_BACKWARD_FOURTH) != 0u;
const uint SUMS = WITH_FOURTH ? 12u : ABSOLUTE ? 11u : 9u;
TEXELS(0, records);
layout(set = 0, binding = 1, scalar) readonly buffer Splats { uint splats[]; };
layout(set = 0, binding = 2, scalar) readonly buffer TileStarts { uint tile_starts[]; };
TEXELS(3, planes);
TEXELS(4, image_gradient);
STORED_TEXELS(5, slots);
layout(push_constant, scalar) uniform Push { BlendPush push; };
#include "lib/tile.glsl"
#include "lib/tile_sums.glsl"
#include "lib/tile_columns.glsl"

// The middle of a lane's pixels, in pixels of its column.
#define MIDDLE (0.5 * float(PIXELS - 1u))

void main() {
    const uint tile = gl_WorkGroupID.x * push.tile_step[0] + gl_WorkGroupID.y * push.tile_step[1];
    if (tile >= push.tiles[0] * push.tiles[1]) return;
    const uint lane = LANE, place = own_place(), px = first_pixel(tile).x, py = first_pixel(tile).y;
    const vec2 pixel = vec2(px, py) + 0.5;

    float T[PIXELS], rest[PIXELS], fourth[PIXELS], by_red[PIXELS], by_green[PIXELS], by_blue[PIXELS], red[PIXELS],
        green[PIXELS], blue[PIXELS];
    vec3 gradient[PIXELS];
    COLUMN_OF(image_gradient, PLANE_R, by_red);
    COLUMN_OF(image_gradient, PLANE_G, by_green);
    COLUMN_OF(image_gradient, PLANE_B, by_blue);
    COLUMN_OF(planes, PLANE_R, red);
    COLUMN_OF(planes, PLANE_G, green);
    COLUMN_OF(planes, PLANE_B, blue);
    [[unroll]] for (uint p = 0; p < PIXELS; ++p) {
        T[p] = px < push.image.size[0] && py + p * ROW_STEP < push.image.size[1] ? 1.0 : -1.0;
        gradient[p] = vec3(by_red[p], by_green[p], by_blue[p]);
        rest[p] = dot(gradient[p], vec3(red[p], green[p], blue[p]));
    }
    // The light that passes all splats also depends on each of them: it is one more thing behind them.
    if (WITH_ALPHA) {
        float by_left[PIXELS], left[PIXELS];
        COLUMN_OF(image_gradient, PLANE_T, by_left);
        COLUMN_OF(planes, PLANE_T, left);
        [[unroll]] for (uint p = 0; p < PIXELS; ++p) rest[p] += by_left[p] * left[p];
    }
    if (WITH_FOURTH) {
        float depth[PIXELS];
        COLUMN_OF(image_gradient, PLANE_DEPTH, fourth);
        COLUMN_OF(planes, PLANE_DEPTH, depth);
        [[unroll]] for (uint p = 0; p < PIXELS; ++p) rest[p] += fourth[p] * depth[p];
    }
    const uint end = tile_starts[tile + 1u];
    uint k = tile_starts[tile];
    // The condition of the loop comes last, as in blend.comp.
    if (k < end) do {
        const Loaded batch = load_batch(k, end);
        float slot[12] = NO_GRADIENT;
        UNROLL_BLOCKS for (uint first = 0; first < (IN_QUADS ? batch.turns : BATCH); first += BLOCK) {
            float sums[12][8];
            [[unroll]] for (uint j = 0; j < BLOCK; ++j) {
                const LaneSplat s = lane_splat(batch, first + j, pixel);
                float raw[PIXELS];
                column_alphas(s, raw);
                // u and v are affine along the lane's column, so three sums over it give all six moments. The pixel's
                // index is counted from the middle. This needs products with constants and a third of the registers.
                float s0 = 0.0, s1 = 0.0, s2 = 0.0;
                vec2 absolute = vec2(0.0);
                vec3 color_sum = vec3(0.0);
                float fourth_sum = 0.0;
                [[unroll]] for (uint p = 0; p < PIXELS; ++p) {
                    const float alpha = alpha_of(raw[p]);
                    bool blended;
                    const float before = T[p];
                    const float weight = composite(alpha, T[p], blended);
                    float shade = dot(s.color, gradient[p]);
                    if (WITH_FOURTH) shade += s.z * fourth[p];
                    const float own = weight * shade;
                    rest[p] -= own;
                    // dL/d(power), which is zero where alpha is clamped: alpha dL/d(alpha), or depth (1 - alpha) dL/d(alpha).
                    float g = 0.0;
                    if (BY_DEPTH) {
                        const bool moves = blended && alpha > 0.0 && raw[p] <= depth_of(float(ALPHA_MAX));
                        g = moves ? raw[p] * (before * (1.0 - alpha) * shade - rest[p]) : 0.0;
                    } else {
                        const bool moves = blended && raw[p] <= float(ALPHA_MAX);
                        g = moves ? own - rest[p] * (alpha / (1.0 - alpha)) : 0.0;
                    }
                    const float step = float(p) - MIDDLE;
                    s0 += g;
                    s1 += g * step;
                    s2 += g * (step * step);
                    if (ABSOLUTE) {
                        const float u = s.u + s.u_step * float(p), v = s.v + s.v_step * float(p);
                        absolute += abs(g * vec2(u, s.u_step * u + s.v_step * v));
                    }
                    color_sum += weight * gradient[p];
                    if (WITH_FOURTH) fourth_sum += weight * fourth[p];
                }
                const float u = s.u + s.u_step * MIDDLE, v = s.v + s.v_step * MIDDLE;
                const float us1 = s.u_step * s1, vs1 = s.v_step * s1, us2 = s.u_step * s2;
                sums[0][j] = s0;
                sums[1][j] = u * s0 + us1;
                sums[2][j] = v * s0 + vs1;
                sums[3][j] = u * (u * s0 + 2.0 * us1) + s.u_step * us2;
                sums[4][j] = u * (v * s0 + vs1) + v * us1 + s.v_step * us2;
                sums[5][j] = v * (v * s0 + 2.0 * vs1) + s.v_step * s.v_step * s2;
                sums[6][j] = color_sum.r;
                sums[7][j] = color_sum.g;
                sums[8][j] = color_sum.b;
                sums[9][j] = absolute.x;
                sums[10][j] = absolute.y / float(ROW_STEP);
                sums[11][j] = fourth_sum;
            }
            const uint summed = QUADS != 0u ? place_of(batch, first + lane) : 0u;
            [[unroll]] for (uint i = 0; i < SUMS; ++i) {
                const float sum = transposing_sum(sums[i]);
                if (QUADS == 0u)
                    slot[i] = first == 0u || lane / BLOCK == first / BLOCK ? sum : slot[i];
                else if (lane < BLOCK && first + lane < batch.picks)
                    shared_sums[sum_at(SUBGROUP_INDEX, i, summed)] = sum;
            }
        }
        bool open = false;
        [[unroll]] for (uint p = 0; p < PIXELS; ++p) open = open || T[p] > 0.0;
        const bool closed = all_closed(open);
        if (place < BATCH && k + place < end) {
            if (QUADS != 0u) add_tiles(batch, place, slot);
            write_slot(slot_of(k + place), slot);
        }
        k += BATCH;
        if (closed) break;
    } while (k < end);
    write_other_slots(k, end, tile);
}
