#version 460
// SPDX-License-Identifier: Apache-2.0
// Lists the splats of a view, or of its band, that reach a tile, in the order of the splats.
// One invocation owns splat i. It reads its record, its tile count and the prefix sums of the tile counts' flags. It writes
// its index in all lists, and copies its record to the list's records. A record of a band has its mean in the band.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/band.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
TEXELS(0, records);
layout(set = 0, binding = 1, scalar) readonly buffer TileCounts { uint tile_counts[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Prefix { uint prefix[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Totals { uint totals[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer ListIndices { uint list_indices[]; };
STORED_TEXELS(5, visible);
layout(push_constant, scalar) uniform Push { CollectVisiblePush push; };

void main() {
    const uint i = item_index();
    if (i >= push.splats) return;
    const bool listed = tile_counts[i] > 0u;
    const uint index = prefix[i] + totals[i / push.scan_block];
    list_indices[push.list * push.splats + i] = listed ? push.first_index + index : NOT_LISTED;
    if (!listed) return;
    const uint at = RECORD_TEXELS * (push.first_record + index);
    visible[at] = as_texel(from_row(fetch(records, RECORD_TEXELS * i), push.first_row));
    [[unroll]] for (uint t = 1; t < RECORD_TEXELS; ++t) visible[at + t] = as_texel(fetch(records, RECORD_TEXELS * i + t));
}
