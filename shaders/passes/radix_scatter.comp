#version 460
// SPDX-License-Identifier: Apache-2.0
// Moves the pairs of a radix pass. The sort is stable.
// One invocation owns the same chunk as in radix_count and goes through it in order. Its counters now hold the position
// of its next item of each digit within that digit; bases[digit] is where the digit begins.
// It reads keys, values and indices, updates its counters, and writes keys, values and indices in the new order.
// SPEC_MODE: SORT_* bits.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/sorting.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool OWN_INDICES = (MODE & SORT_OWN_INDICES) != 0u, DROP_KEYS = (MODE & SORT_DROP_KEYS) != 0u,
           TRACKED = (MODE & SORT_TRACKED) != 0u, FIRST = (MODE & SORT_FIRST) != 0u, LAST = (MODE & SORT_LAST) != 0u;

WORD_TEXELS(0, keys);
WORD_TEXELS(1, values);
layout(set = 0, binding = 2, scalar) buffer Counters { uint counters[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Bases { uint bases[]; };
layout(set = 0, binding = 4, scalar) readonly buffer CountsBlock { Counts counts; };
layout(set = 0, binding = 5, scalar) writeonly buffer KeysOut { uint keys_out[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer ValuesOut { uint values_out[]; };
WORD_TEXELS(7, indices);
layout(set = 0, binding = 8, scalar) writeonly buffer IndicesOut { uint indices_out[]; };
layout(push_constant, scalar) uniform Push { SortPush push; };

void main() {
    const uint lane = item_index();
    if (lane >= push.lanes) return;
    const uint items = item_count(push, counts.instances);
    const uint texels = (items + 3u) / 4u, chunk = chunk_texels(items, push.lanes);
    const uint begin = min(lane * chunk, texels), end = min(begin + chunk, texels);
    for (uint t = begin; t < end; ++t) {
        const uvec4 four = fetch(keys, t);
        const uvec4 own = 4u * t + uvec4(0, 1, 2, 3);
        const uvec4 carried = OWN_INDICES ? own : fetch(values, t);
        const uvec4 index = FIRST ? own : fetch(indices, t);
        [[unroll]] for (uint c = 0; c < 4; ++c) {
            if (4u * t + c < items) {
                const uint digit = digit_of(four[c], push.shift);
                const uint counter = digit * push.lanes + lane;
                const uint within = counters[counter];
                counters[counter] = within + 1u;
                const uint to = bases[digit] + within;
                if (!DROP_KEYS) keys_out[to] = four[c];
                values_out[to] = carried[c];
                if (TRACKED) indices_out[LAST ? index[c] : to] = LAST ? to : index[c];
            }
        }
    }
}
