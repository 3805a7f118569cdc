#version 460
// SPDX-License-Identifier: Apache-2.0
// Adds the gradient slots of each splat of a view's list.
// One invocation owns entry i of the list. It reads its slots in the order of its tiles, and writes their sums at its list index
// among the lists of all views. SPEC_MODE: 0 or UPDATE_ABSOLUTE.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool ABSOLUTE = (MODE & UPDATE_ABSOLUTE) != 0u, BY_DEPTH_PLANE = (MODE & UPDATE_DEPTH) != 0u;
const uint FLOATS = BY_DEPTH_PLANE ? SUM_FLOATS_DEPTH : ABSOLUTE ? SUM_FLOATS_ABSOLUTE : SUM_FLOATS;

TEXELS(0, records);
TEXELS(1, slots);
layout(set = 0, binding = 2, scalar) readonly buffer TileCounts { uint tile_counts[]; };
layout(set = 0, binding = 3, scalar) readonly buffer FirstInstances { uint first_instances[]; };
layout(set = 0, binding = 4, scalar) readonly buffer SortedIndices { uint sorted_indices[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer SumsOut { float sums[]; };
layout(push_constant, scalar) uniform Push { SumSlotsPush push; };
#include "lib/slots.glsl"

void main() {
    const uint i = item_index();
    if (i >= push.splats) return;
    vec4 sum[SLOT_TEXELS];
    sum_slots(first_instances[i], tile_counts[i], ABSOLUTE || BY_DEPTH_PLANE, sum);
    // max(0, .) passes no gradient where the colour is zero.
    const vec3 shown = fetch(records, RECORD_TEXELS * i + 2u).rgb;
    const vec3 color = vec3(sum[1].zw, sum[2].x) * vec3(greaterThan(shown, vec3(0.0)));
    const float all[SUM_FLOATS_DEPTH] =
        float[](sum[0].x, sum[0].y, sum[0].z, sum[0].w, sum[1].x, sum[1].y, color.x, color.y, color.z, sum[2].y, sum[2].z, sum[2].w);
    [[unroll]] for (uint f = 0; f < FLOATS; ++f) sums[FLOATS * (push.first_index + i) + f] = all[f];
}
