#version 460
// SPDX-License-Identifier: Apache-2.0
// Moves the pairs of a radix pass. One invocation owns the same chunk as in radix_count, and walks it in order; its
// counters now hold the position of its next item of each digit within that digit, and bases[digit] where the digit
// begins. Stable. SPEC_MODE bit 0: the values are the items' own numbers; bit 1: nobody reads the keys again (last
// pass); bit 2: the items' own numbers come along beside their values, and the last pass writes where each item went,
// numbers_out[number] = place, instead; bit 3: first pass, where the numbers are not stored yet; bit 4: last pass.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/sorting.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool IMPLICIT_VALUES = (MODE & 1u) != 0u, DROP_KEYS = (MODE & 2u) != 0u, NUMBERED = (MODE & 4u) != 0u,
           FIRST = (MODE & 8u) != 0u, LAST = (MODE & 16u) != 0u;

layout(set = 0, binding = 0) uniform usamplerBuffer keys;
layout(set = 0, binding = 1) uniform usamplerBuffer values;
layout(set = 0, binding = 2, scalar) buffer Counters { uint counters[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Bases { uint bases[]; };
layout(set = 0, binding = 4, scalar) readonly buffer CountsBlock { Counts counts; };
layout(set = 0, binding = 5, scalar) writeonly buffer KeysOut { uint keys_out[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer ValuesOut { uint values_out[]; };
layout(set = 0, binding = 7) uniform usamplerBuffer numbers;
layout(set = 0, binding = 8, scalar) writeonly buffer NumbersOut { uint numbers_out[]; };
layout(push_constant, scalar) uniform Push { SortPush push; };

void main() {
    const uint lane = item_index();
    if (lane >= push.lanes) return;
    const uint items = item_count(push, counts.instances);
    const uint texels = (items + 3u) / 4u, chunk = chunk_texels(items, push.lanes);
    const uint begin = min(lane * chunk, texels), end = min(begin + chunk, texels);
    for (uint t = begin; t < end; ++t) {
        const uvec4 four = texelFetch(keys, int(t));
        const uvec4 own = 4u * t + uvec4(0, 1, 2, 3);
        const uvec4 carried = IMPLICIT_VALUES ? own : texelFetch(values, int(t));
        const uvec4 number = FIRST ? own : texelFetch(numbers, int(t));
        [[unroll]] for (uint c = 0; c < 4; ++c) {
            if (4u * t + c < items) {
                const uint digit = digit_of(four[c], push.shift);
                const uint counter = digit * push.lanes + lane;
                const uint within = counters[counter];
                counters[counter] = within + 1u;
                const uint to = bases[digit] + within;
                if (!DROP_KEYS) keys_out[to] = four[c];
                values_out[to] = carried[c];
                if (NUMBERED) numbers_out[LAST ? number[c] : to] = LAST ? to : number[c];
            }
        }
    }
}
