#version 460
// SPDX-License-Identifier: Apache-2.0
// Prepares a list of records for its view: what project.comp writes beside a record follows from the record.
// One invocation owns record i. It writes its depth key and the number of tiles that it reaches.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/footprint.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
TEXELS(0, records);
layout(set = 0, binding = 1, scalar) writeonly buffer DepthKeys { uint depth_keys[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer TileCounts { uint tile_counts[]; };
layout(push_constant, scalar) uniform Push { ReceivePush push; };

void main() {
    const uint i = item_index();
    if (i >= push.splats) return;
    const uvec2 size = uvec2(push.size[0], push.size[1]);
    const Footprint f =
        footprint_of(fetch(records, RECORD_TEXELS * i), fetch(records, RECORD_TEXELS * i + 1u), size);
    depth_keys[i] = floatBitsToUint(fetch(records, RECORD_TEXELS * i + 2u).w);
    tile_counts[i] = count_tiles(f, f.row_begin, f.row_end, size);
}
