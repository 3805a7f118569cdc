#version 460
// SPDX-License-Identifier: Apache-2.0
// Absolute gradients of blending by the means: the sum over pixels of |dL/d(mean)|, in which dL/d(mean) is of all channels.
// blend_backward.comp has the formulas; it sees 4 channels at a time, and |a| + |b| is not |a + b|.
// One workgroup is one subgroup and owns one tile. It reads the tile's sorted splats, their records and features, and what
// each pixel has: dL/d(channel), 4 channels a texel, and in a last texel R before the first splat. It writes the gradient
// slots of the tile's instances: floats 9 and 10, and zeros. SPEC_MODE: the number of channels.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint CHANNELS = 5;
const uint GROUPS = (CHANNELS + 3u) / 4u;
const uint SUMS = 11u;
TEXELS(0, records);
layout(set = 0, binding = 1, scalar) readonly buffer Splats { uint splats[]; };
layout(set = 0, binding = 2, scalar) readonly buffer TileStarts { uint tile_starts[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Features { float features[]; };
TEXELS(4, pixels);
STORED_TEXELS(5, slots);
layout(push_constant, scalar) uniform Push { BlendPush push; };
#include "lib/tile.glsl"
#include "lib/tile_sums.glsl"

// Features of a splat, and zeros behind its last channel.
vec4 group_of(uint splat, uint group) {
    vec4 values = vec4(0.0);
    [[unroll]] for (uint c = 0; c < 4; ++c) {
        if (4u * group + c < CHANNELS) values[c] = features[CHANNELS * splat + 4u * group + c];
    }
    return values;
}

void main() {
    const uint tile = gl_WorkGroupID.x * push.tile_step[0] + gl_WorkGroupID.y * push.tile_step[1];
    if (tile >= push.tiles[0] * push.tiles[1]) return;
    const uint lane = LANE, px = first_pixel(tile).x, py = first_pixel(tile).y;
    const vec2 pixel = vec2(px, py) + 0.5;
    const uint width = push.image.size[0], height = push.image.size[1];

    float T[PIXELS], rest[PIXELS];
    uint at[PIXELS];
    [[unroll]] for (uint p = 0; p < PIXELS; ++p) {
        const uint y = py + p * ROW_STEP;
        at[p] = min(y, height - 1u) * width + min(px, width - 1u);
        T[p] = px < width && y < height ? 1.0 : -1.0;
        rest[p] = fetch(pixels, GROUPS * width * height + at[p]).x;
    }
    const uint end = tile_starts[tile + 1u];
    uint k = tile_starts[tile];
    // The condition of the loop comes last, as in blend.comp.
    if (k < end) do {
        const Loaded batch = load_batch(k, end);
        float slot[12] = NO_GRADIENT;
        UNROLL_BLOCKS for (uint first = 0; first < SUBGROUP; first += BLOCK) {
            float sums_x[8], sums_y[8];
            [[unroll]] for (uint j = 0; j < BLOCK; ++j) {
                const LaneSplat s = lane_splat(batch, first + j, pixel);
                float raw[PIXELS], shade[PIXELS];
                column_alphas(s, raw);
                [[unroll]] for (uint p = 0; p < PIXELS; ++p) shade[p] = 0.0;
                const uint splat = splat_of(min(k + first + j, end - 1u));
                [[dont_unroll]] for (uint group = 0; group < GROUPS; ++group) {
                    const vec4 feature = group_of(splat, group);
                    [[unroll]] for (uint p = 0; p < PIXELS; ++p)
                        shade[p] += dot(feature, fetch(pixels, group * width * height + at[p]));
                }
                vec2 absolute = vec2(0.0);
                [[unroll]] for (uint p = 0; p < PIXELS; ++p) {
                    const float alpha = alpha_of(raw[p]);
                    bool blended;
                    const float weight = composite(alpha, T[p], blended);
                    // The features of a skipped splat may be anything.
                    const float own = weight > 0.0 ? weight * shade[p] : 0.0;
                    rest[p] -= own;
                    const bool moves = blended && raw[p] <= float(ALPHA_MAX);
                    const float g = moves ? own - rest[p] * (alpha / (1.0 - alpha)) : 0.0;
                    const float u = s.u + s.u_step * float(p), v = s.v + s.v_step * float(p);
                    absolute += abs(g * vec2(u, s.u_step * u + s.v_step * v));
                }
                sums_x[j] = absolute.x;
                sums_y[j] = absolute.y / float(ROW_STEP);
            }
            const bool own_block = first == 0u || lane / BLOCK == first / BLOCK;
            const float x = transposing_sum(sums_x), y = transposing_sum(sums_y);
            slot[9] = own_block ? x : slot[9];
            slot[10] = own_block ? y : slot[10];
        }
        if (k + lane < end) write_slot(k + lane, slot);
        bool open = false;
        [[unroll]] for (uint p = 0; p < PIXELS; ++p) open = open || T[p] > 0.0;
        k += SUBGROUP;
        if (subgroupAll(!open)) break;
    } while (k < end);
    write_other_slots(k, end, tile);
}
