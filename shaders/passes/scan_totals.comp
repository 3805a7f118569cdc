#version 460
// SPDX-License-Identifier: Apache-2.0
// Exclusive prefix sum of the blocks' totals, in place; entry `blocks` becomes the grand total.
// One workgroup of one subgroup does all of it. It may also write the grand total to Counts: TOTAL_*.
// With TOTAL_INSTANCES and push.sort_keys it also writes how many workgroups sort the instances.
// Instances are also counted in two 16-bit halves, which cannot wrap. A total above 32 bits is reported as 0xffffffff.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) buffer Totals { uint totals[]; };
layout(set = 0, binding = 1, scalar) buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { ScanTotalsPush push; };

void main() {
    uint carry = 0u, low = 0u, high = 0u;
    for (uint base = 0u; base < push.blocks; base += SCANNED) {
        uint value[SCAN_AHEAD];
        [[unroll]] for (uint a = 0; a < SCAN_AHEAD; ++a) {
            const uint e = base + a * SUBGROUP + LANE;
            value[a] = 0u;
            if (e < push.blocks) value[a] = totals[e];
        }
        [[unroll]] for (uint a = 0; a < SCAN_AHEAD; ++a) {
            const uint e = base + a * SUBGROUP + LANE;
            low += value[a] & 0xffffu;
            high += value[a] >> 16;
            const uint sum = subgroup_inclusive_sum(value[a]);
            if (e < push.blocks) totals[e] = carry + sum - value[a];
            carry += subgroupShuffle(sum, SUBGROUP - 1u);
        }
    }
    low = subgroupShuffle(subgroup_inclusive_sum(low), SUBGROUP - 1u);
    high = subgroupShuffle(subgroup_inclusive_sum(high), SUBGROUP - 1u);
    const bool wrapped = high + (low >> 16) > 0xffffu;
    if (LANE == 0u) {
        totals[push.blocks] = carry;
        if (push.total == TOTAL_INSTANCES) {
            const bool overflowed = counts.overflowed != 0u;
            const uint needed = wrapped || overflowed ? 0xffffffffu : carry;
            counts.instances = needed;
            counts.overflowed = needed > push.capacity ? 1u : 0u;
            if (push.sort_keys > 0u) {
                const uint items = needed > push.capacity ? 0u : needed;
                const uint blocks = (items + push.sort_keys - 1u) / push.sort_keys;
                const uint rows = max((blocks + push.max_groups - 1u) / push.max_groups, 1u);
                counts.sort_blocks = blocks;
                counts.sort_groups = uint[3]((blocks + rows - 1u) / rows, rows, 1u);
            }
        }
        if (push.total == TOTAL_SCAN) counts.scan_total = carry;
    }
}
