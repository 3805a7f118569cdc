// SPDX-License-Identifier: Apache-2.0
// Sums over a subgroup by shuffles with constant distances. They cost next to nothing where
// subgroup arithmetic is slow.
#ifndef EWA_LIB_SUBGROUP
#define EWA_LIB_SUBGROUP
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_shuffle : require
layout(constant_id = SPEC_SUBGROUP) const uint SUBGROUP = 8;

// Steps of doubling distance, up to 64 lanes. The loops below count up by one and stop by a constant condition: some
// compilers do not unroll a loop that doubles its counter, and its iterations count towards a driver's limit.
const uint DOUBLINGS = 6u;

float subgroup_sum(float x) {
    [[unroll]] for (uint s = 0u; s < DOUBLINGS; ++s) {
        if ((1u << s) < SUBGROUP) x += subgroupShuffleXor(x, 1u << s);
    }
    return x;
}

// Sum over lanes 0 to this one, inclusive.
uint subgroup_inclusive_sum(uint x) {
    const uint lane = gl_SubgroupInvocationID;
    [[unroll]] for (uint s = 0u; s < DOUBLINGS; ++s) {
        if ((1u << s) < SUBGROUP) {
            const uint below = subgroupShuffle(x, lane >= (1u << s) ? lane - (1u << s) : lane);
            x += lane >= (1u << s) ? below : 0u;
        }
    }
    return x;
}
#endif
