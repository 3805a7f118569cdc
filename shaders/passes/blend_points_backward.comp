#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of blending spheres, front to back as in blend_backward.comp: dL/d(alpha) = T c . dL/dC - R / (1 - alpha), R the
// part of C . dL/dC that lies behind the sphere. A sphere behind the nearest NEAREST has no gradient.
// One workgroup is one subgroup and owns one tile. It reads the tile's sorted splats, their records, the image planes
// and dL/d(image). It writes the gradient slots of the tile's instances, each slot once. Slots are in sorted order, and hold
// the sums of a footprint's slot with g = dL/d(alpha): d(alpha) = d(power), as both are 1 - (u^2 + v^2) plus a constant.
// SPEC_MODE: BLEND_BACKWARD_ABSOLUTE.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool ABSOLUTE = (MODE & BLEND_BACKWARD_ABSOLUTE) != 0u;
const uint SUMS = ABSOLUTE ? 11u : 9u;
TEXELS(0, records);
layout(set = 0, binding = 1, scalar) readonly buffer Splats { uint splats[]; };
layout(set = 0, binding = 2, scalar) readonly buffer TileStarts { uint tile_starts[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Planes { float planes[]; };
layout(set = 0, binding = 4, scalar) readonly buffer ImageGradient { float image_gradient[]; };
STORED_TEXELS(5, slots);
layout(push_constant, scalar) uniform Push { BlendPush push; };
#include "lib/tile.glsl"
#include "lib/tile_sums.glsl"
#include "lib/sphere_blending.glsl"

void main() {
    const uint tile = gl_WorkGroupID.x * push.tile_step[0] + gl_WorkGroupID.y * push.tile_step[1];
    if (tile >= push.tiles[0] * push.tiles[1]) return;
    const uint lane = LANE, px = first_pixel(tile).x, py = first_pixel(tile).y;
    const vec2 pixel = vec2(px, py) + 0.5;

    float T[PIXELS], rest[PIXELS];
    uint left[PIXELS];
    vec3 gradient[PIXELS];
    [[unroll]] for (uint p = 0; p < PIXELS; ++p) {
        const uint y = py + p * ROW_STEP;
        const bool inside = px < push.image.size[0] && y < push.image.size[1];
        const uint at = min(y, push.image.size[1] - 1u) * push.image.stride + min(px, push.image.size[0] - 1u);
        T[p] = 1.0;
        left[p] = inside ? NEAREST : 0u;
        gradient[p] = vec3(image_gradient[PLANE_R * push.image.plane_floats + at],
                           image_gradient[PLANE_G * push.image.plane_floats + at],
                           image_gradient[PLANE_B * push.image.plane_floats + at]);
        rest[p] = dot(gradient[p], vec3(planes[PLANE_R * push.image.plane_floats + at],
                                        planes[PLANE_G * push.image.plane_floats + at],
                                        planes[PLANE_B * push.image.plane_floats + at]));
    }
    const uint end = tile_starts[tile + 1u];
    uint k = tile_starts[tile];
    for (; k < end; k += SUBGROUP) {
        const Loaded batch = load_batch(k, end);
        float slot[12] = NO_GRADIENT;
        UNROLL_BLOCKS for (uint first = 0; first < SUBGROUP; first += BLOCK) {
            float sums[11][8];
            [[unroll]] for (uint j = 0; j < BLOCK; ++j) {
                const LaneSplat s = lane_splat(batch, first + j, pixel);
                float s0 = 0.0;
                vec2 s1 = vec2(0.0), s2 = vec2(0.0), absolute = vec2(0.0);
                vec3 color_sum = vec3(0.0);
                [[unroll]] for (uint p = 0; p < PIXELS; ++p) {
                    const float before = T[p];
                    const Meeting m = meet_sphere(s, p, left[p], T[p]);
                    const float light = dot(s.color, gradient[p]);
                    rest[p] -= m.weight * light;
                    // Zero where alpha is clamped.
                    const bool moves = m.alpha > 0.0 && m.raw <= float(ALPHA_MAX);
                    const float g = moves ? before * light - rest[p] / (1.0 - m.alpha) : 0.0;
                    const vec2 w = vec2(m.u, m.v);
                    s0 += g;
                    // Outside the sphere u and v may be anything.
                    s1 += moves ? g * w : vec2(0.0);
                    s2 += moves ? g * w * w : vec2(0.0);
                    if (ABSOLUTE) absolute += moves ? abs(g * w) : vec2(0.0);
                    color_sum += m.weight * gradient[p];
                }
                sums[0][j] = s0;
                sums[1][j] = s1.x;
                sums[2][j] = s1.y;
                sums[3][j] = s2.x;
                sums[4][j] = 0.0;  // of u v: a sphere does not turn
                sums[5][j] = s2.y;
                sums[6][j] = color_sum.r;
                sums[7][j] = color_sum.g;
                sums[8][j] = color_sum.b;
                sums[9][j] = absolute.x;
                sums[10][j] = absolute.y;
            }
            [[unroll]] for (uint i = 0; i < SUMS; ++i) {
                const float sum = transposing_sum(sums[i]);
                slot[i] = first == 0u || lane / BLOCK == first / BLOCK ? sum : slot[i];
            }
        }
        if (k + lane < end) write_slot(k + lane, slot);
        bool open = false;
        [[unroll]] for (uint p = 0; p < PIXELS; ++p) open = open || left[p] > 0u;
        if (subgroupAll(!open)) {
            k += SUBGROUP;
            break;
        }
    }
    write_other_slots(k, end, tile);
}
