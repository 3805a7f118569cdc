#version 460
// SPDX-License-Identifier: Apache-2.0
// Counts the tiles of a band of the view that each splat reaches.
// One invocation owns splat i. It reads its record and its depth key, and writes the count.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/band.glsl"
#include "lib/footprint.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
TEXELS(0, records);
layout(set = 0, binding = 1, scalar) readonly buffer DepthKeys { uint depth_keys[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer TileCounts { uint tile_counts[]; };
layout(push_constant, scalar) uniform Push { BandTilesPush push; };

void main() {
    const uint i = item_index();
    if (i >= push.splats) return;
    uint count = 0u;
    // The last key: not visible.
    if (depth_keys[i] != 0xffffffffu) {
        const uvec2 size = uvec2(push.size[0], push.size[1]);
        const Footprint f = footprint_of(from_row(fetch(records, RECORD_TEXELS * i), push.first_row),
                                         fetch(records, RECORD_TEXELS * i + 1u), size);
        count = count_tiles(f, f.row_begin, f.row_end, size);
    }
    tile_counts[i] = count;
}
