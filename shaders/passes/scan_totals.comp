#version 460
// Exclusive prefix sum of the blocks' totals, in place, by one subgroup; entry `blocks` gets the grand total.
// Counts receives 0xffffffff where the total does not fit in 32 bits.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) buffer Totals { uint totals[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { ScanTotalsPush push; };

void main() {
    uint carry = 0u;
    float estimate = 0.0;
    for (uint base = 0u; base < push.blocks; base += SUBGROUP) {
        const uint e = base + gl_SubgroupInvocationID;
        uint value = 0u;
        if (e < push.blocks) value = totals[e];
        const uint sum = subgroup_inclusive_sum(value);
        if (e < push.blocks) totals[e] = carry + sum - value;
        carry += subgroupShuffle(sum, SUBGROUP - 1u);
        estimate += subgroup_sum(float(value));
    }
    if (gl_SubgroupInvocationID == 0u) {
        totals[push.blocks] = carry;
        if (estimate > 4.29e9) carry = 0xffffffffu;
        if (push.write_instances == 1u) counts.instances = carry;
        if (push.write_instances == 2u) counts.densified = carry;
    }
}
