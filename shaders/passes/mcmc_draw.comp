#version 460
// SPDX-License-Identifier: Apache-2.0
// Draws the sources of relocated and added splats: source e with probability weight[e] / total.
// One invocation owns draw d. It looks its random number up in the prefix sums, writes sources[d] and counts the hit. A
// source that another rank holds is NOT_LISTED.
// Hits are integer sums, so their order does not matter.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/random.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Prefix { uint prefix[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Totals { uint totals[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Sources { uint sources[]; };
layout(set = 0, binding = 3, scalar) buffer Hits { uint hits[]; };
layout(push_constant, scalar) uniform Push { McmcPush push; };

void main() {
    const uint d = item_index();
    if (d >= push.draws) return;
    const uint random = pcg4d(uvec4(d, push.step, push.seed[0], push.seed[1] ^ MCMC_DRAW_STREAM)).x;
    uint target, low_bits;
    umulExtended(random, push.total, target, low_bits);
    target -= push.total_before;   // of a rank before this one: above own_total
    if (target >= push.own_total) {
        sources[d] = NOT_LISTED;
        return;
    }
    // The last block, then its last entry, whose prefix sum is at most the target. That entry's weight is above 0.
    uint low = 0u, high = (push.splats + push.scan_block - 1u) / push.scan_block;
    while (high - low > 1u) {
        const uint middle = (low + high) / 2u;
        if (totals[middle] <= target) low = middle;
        else high = middle;
    }
    const uint rest = target - totals[low];
    uint first = low * push.scan_block, end = min(first + push.scan_block, push.splats);
    while (end - first > 1u) {
        const uint middle = (first + end) / 2u;
        if (prefix[middle] <= rest) first = middle;
        else end = middle;
    }
    sources[d] = first;
    atomicAdd(hits[first], 1u);
}
