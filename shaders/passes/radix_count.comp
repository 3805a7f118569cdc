#version 460
// SPDX-License-Identifier: Apache-2.0
// Counts the digits of a radix pass.
// One invocation owns a contiguous chunk of the keys and a private row of counters, counters[digit * lanes +
// lane]. It reads the keys and increments the counters, which are zero before. There are no atomics, so equal
// keys keep their order.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/sorting.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
WORD_TEXELS(0, keys);
layout(set = 0, binding = 1, scalar) buffer Counters { uint counters[]; };
layout(set = 0, binding = 2, scalar) readonly buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { SortPush push; };

void main() {
    const uint lane = item_index();
    if (lane >= push.lanes) return;
    const uint items = item_count(push, counts.instances);
    const uint texels = (items + 3u) / 4u, chunk = chunk_texels(items, push.lanes);
    const uint begin = min(lane * chunk, texels), end = min(begin + chunk, texels);
    for (uint t = begin; t < end; ++t) {
        const uvec4 four = fetch(keys, t);
        [[unroll]] for (uint c = 0; c < 4; ++c) {
            if (4u * t + c < items) counters[digit_of(four[c], push.shift) * push.lanes + lane] += 1u;
        }
    }
}
