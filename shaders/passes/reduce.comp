#version 460
// SPDX-License-Identifier: Apache-2.0
// Adds the floats of each row in a fixed order.
// One workgroup is one subgroup and owns one block of row workgroup.z. It writes the sum to that block's place in sums
// or to the row's place in Counts: REDUCE_TO_*.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Source { float source[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Sums { float sums[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { ReducePush push; };

void main() {
    const uint block = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    const uint row = gl_WorkGroupID.z, blocks = (push.items + push.block - 1u) / push.block;
    if (block >= blocks) return;
    const uint begin = row * push.items + block * push.block;
    const uint end = min(begin + push.block, (row + 1u) * push.items);
    float sum = 0.0;
    for (uint e = begin + LANE; e < end; e += SUBGROUP) sum += source[e];
    sum = subgroup_sum(sum) * push.scale;
    if (LANE != 0u) return;
    const uint target = push.target == REDUCE_TO_SUMS ? REDUCE_TO_SUMS : push.target + row;
    if (target == REDUCE_TO_SUMS) sums[row * blocks + block] = sum;
    if (target == REDUCE_TO_SSIM) counts.ssim = sum;
    if (target == REDUCE_TO_L1) counts.l1 = sum;
    if (target == REDUCE_TO_SQUARED) counts.squared = sum;
    if (target == REDUCE_TO_L2) counts.l2 = sum;
    if (target == REDUCE_TO_ALPHA) counts.alpha = sum;
    if (target == REDUCE_TO_DEPTH) counts.depth = sum;
}
