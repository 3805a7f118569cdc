#version 460
// SPDX-License-Identifier: Apache-2.0
// Lists the splats of a view that reach a tile, in the order of the splats.
// One invocation owns splat i. It reads its record, its tile count and the prefix sums of the tile counts' flags. It writes
// its place among the lists of all views, and copies its record to the view's records.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
TEXELS(0, records);
layout(set = 0, binding = 1, scalar) readonly buffer TileCounts { uint tile_counts[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Prefix { uint prefix[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Totals { uint totals[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Places { uint places[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer Visible { vec4 visible[]; };
layout(push_constant, scalar) uniform Push { CollectVisiblePush push; };

void main() {
    const uint i = item_index();
    if (i >= push.splats) return;
    const bool listed = tile_counts[i] > 0u;
    const uint index = prefix[i] + totals[i / push.scan_block];
    places[push.view * push.splats + i] = listed ? push.first_place + index : NOT_LISTED;
    if (!listed) return;
    [[unroll]] for (uint t = 0; t < RECORD_TEXELS; ++t) {
        visible[RECORD_TEXELS * (push.first_record + index) + t] = fetch(records, RECORD_TEXELS * i + t);
    }
}
