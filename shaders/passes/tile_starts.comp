#version 460
// SPDX-License-Identifier: Apache-2.0
// Where each tile's instances begin in the sorted list. One invocation owns tile t of 0..tiles and searches its first
// instance; entry `tiles` is the end of the last tile's, and one more the end of the list, where instances that turned
// out not to exist stand.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 1, scalar) readonly buffer CountsBlock { Counts counts; };
layout(set = 0, binding = 2, scalar) writeonly buffer TileStarts { uint tile_starts[]; };
layout(push_constant, scalar) uniform Push { TileStartsPush push; };

void main() {
    const uint tile = item_index();
    if (tile > push.tiles + 1u) return;
    uint low = 0u, high = counts.instances <= push.capacity ? counts.instances : 0u;
    while (low < high) {
        const uint middle = (low + high) / 2u;
        if (keys[middle] < tile)
            low = middle + 1u;
        else
            high = middle;
    }
    tile_starts[tile] = low;
}
