#version 460
// SPDX-License-Identifier: Apache-2.0
// Counts the digits of a radix pass, for devices with fast shared memory.
// One workgroup owns a block of RANKED_KEYS keys. It counts them in shared memory and writes all its counters,
// counters[digit * blocks + block]. The sums are of integers, so the order of the atomics does not matter.
// SPEC_MODE: 0, or SORT_FEW.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"
#include "lib/sorting.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool FEW = (MODE & SORT_FEW) != 0u;
WORD_TEXELS(0, keys);
layout(set = 0, binding = 1, scalar) writeonly buffer Counters { uint counters[]; };
layout(set = 0, binding = 2, scalar) readonly buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { SortPush push; };

shared uint histogram[DIGITS];

void main() {
    const uint block = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x, thread = gl_LocalInvocationID.x;
    if (block >= push.lanes) return;
    const uint items = item_count(push, counts.instances);
    if (FEW && block * RANKED_KEYS >= items) return;
    for (uint d = thread; d < DIGITS; d += GROUP_SIZE) histogram[d] = 0u;
    barrier();
    for (uint t = thread; t < RANKED_KEYS / 4u; t += GROUP_SIZE) {
        const uint first = block * RANKED_KEYS + 4u * t;
        if (first >= items) break;
        const uvec4 four = fetch(keys, first / 4u);
        [[unroll]] for (uint c = 0; c < 4; ++c) {
            if (first + c < items) atomicAdd(histogram[digit_of(four[c], push.shift)], 1u);
        }
    }
    barrier();
    for (uint d = thread; d < DIGITS; d += GROUP_SIZE) counters[FEW ? block * DIGITS + d : d * push.lanes + block] = histogram[d];
}
