#version 460
// SPDX-License-Identifier: Apache-2.0
// Exclusive prefix sums within blocks.
// One workgroup is one subgroup and owns one block of `block` entries. It reads them, and writes for each entry
// the sum of the entries before it in the block, and the block's total. SPEC_MODE: SCAN_GATHERED,
// SCAN_FLAGS or SCAN_LIVE, which say what an entry is, and how many a block has.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
layout(set = 0, binding = 0, scalar) readonly buffer Source { uint source[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Order { uint order[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Prefix { uint prefix[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Totals { uint totals[]; };
layout(set = 0, binding = 4, scalar) readonly buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { ScanPush push; };

void main() {
    const uint block = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    const uint begin = block * push.block;
    if (begin >= push.items) return;
    const uint end = min(begin + (MODE == SCAN_LIVE ? min(counts.sort_blocks, push.block) : push.block), push.items);
    uint carry = 0u;
    for (uint base = begin; base < end; base += SCANNED) {
        uint value[SCAN_AHEAD];
        [[unroll]] for (uint a = 0; a < SCAN_AHEAD; ++a) {
            const uint e = base + a * SUBGROUP + LANE;
            value[a] = 0u;
            if (e < end) value[a] = source[MODE == SCAN_GATHERED ? order[e] : e];
            if (MODE == SCAN_FLAGS) value[a] = min(value[a], 1u);
        }
        [[unroll]] for (uint a = 0; a < SCAN_AHEAD; ++a) {
            const uint e = base + a * SUBGROUP + LANE;
            const uint sum = subgroup_inclusive_sum(value[a]);
            if (e < end) prefix[e] = carry + sum - value[a];
            carry += subgroupShuffle(sum, SUBGROUP - 1u);
        }
    }
    if (LANE == 0u) totals[block] = carry;
}
