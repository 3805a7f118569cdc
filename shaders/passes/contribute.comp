#version 460
// SPDX-License-Identifier: Apache-2.0
// Finds the largest weight alpha * T that each splat has at a pixel of the image.
// One workgroup is one subgroup and owns one tile; with SPEC_QUADS it is four, and owns a quad. It reads the range of the sorted
// splats and their records, and raises largest[splat], the bits of a float of at least zero. Such floats are ordered as their bits
// are, and the order of maxima does not matter.
#extension GL_GOOGLE_include_directive : require
#define BINDING_INDICES 4
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;

TEXELS(0, records);
layout(set = 0, binding = 1, scalar) readonly buffer Splats { uint splats[]; };
layout(set = 0, binding = 2, scalar) readonly buffer TileStarts { uint tile_starts[]; };
layout(set = 0, binding = 3, scalar) buffer Largest { uint largest[]; };
layout(push_constant, scalar) uniform Push { BlendPush push; };
#include "lib/tile.glsl"

// Maximum over the subgroup.
float subgroup_most(float x) {
    [[unroll]] for (uint s = 0u; s < DOUBLINGS; ++s) {
        if ((1u << s) < SUBGROUP) x = max(x, subgroupShuffleXor(x, 1u << s));
    }
    return x;
}

void main() {
    const uint tile = gl_WorkGroupID.x * push.tile_step[0] + gl_WorkGroupID.y * push.tile_step[1];
    if (tile >= push.tiles[0] * push.tiles[1]) return;
    const uint lane = LANE, px = first_pixel(tile).x, py = first_pixel(tile).y;
    const vec2 pixel = vec2(px, py) + 0.5;

    float T[PIXELS];
    [[unroll]] for (uint p = 0; p < PIXELS; ++p)
        T[p] = px < push.image.size[0] && py + p * ROW_STEP < push.image.size[1] ? 1.0 : -1.0;
    const uint end = tile_starts[tile + 1u];
    uint k = tile_starts[tile];
    // The condition of the loop comes last, as in blend.comp.
    if (k < end) do {
        const Loaded batch = load_batch(k, end);
        float own = 0.0;
        UNROLL_BLOCKS for (uint first = 0; first < (IN_QUADS ? batch.turns : BATCH); first += BLOCK) {
            [[unroll]] for (uint j = 0; j < BLOCK; ++j) {
                float raw[PIXELS], most = 0.0;
                column_alphas(lane_splat(batch, first + j, pixel), raw);
                [[unroll]] for (uint p = 0; p < PIXELS; ++p) {
                    bool blended;
                    most = max(most, composite(alpha_of(raw[p]), T[p], blended));
                }
                most = subgroup_most(most);
                own = lane == first + j ? most : own;
                if (QUADS != 0u && lane == 0u && most > 0.0) atomicMax(largest[picked_splat(batch, first + j)], floatBitsToUint(most));
            }
        }
        if (QUADS == 0u && k + lane < end && own > 0.0) atomicMax(largest[splat_of(k + lane)], floatBitsToUint(own));
        bool open = false;
        [[unroll]] for (uint p = 0; p < PIXELS; ++p) open = open || T[p] > 0.0;
        if (all_closed(open)) break;
        k += BATCH;
    } while (k < end);
}
