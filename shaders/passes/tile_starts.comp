#version 460
// SPDX-License-Identifier: Apache-2.0
// Finds where each tile's instances begin in the sorted list.
// One invocation owns entry t of 0..tiles + 1. It searches the keys and writes tile_starts[t], the first instance of
// tile t. Entry `tiles` is the end of the last tile. Entry `tiles + 1` is the end of the list, behind instances with
// the sentinel tile.
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
