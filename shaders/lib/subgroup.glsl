// Sums over a subgroup by shuffles with constant distances, which cost next to nothing where subgroup arithmetic does not.
#ifndef EWA_LIB_SUBGROUP
#define EWA_LIB_SUBGROUP
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_shuffle : require
layout(constant_id = SPEC_SUBGROUP) const uint SUBGROUP = 8;

float subgroup_sum(float x) {
    [[unroll]] for (uint d = 1u; d < SUBGROUP; d *= 2u) x += subgroupShuffleXor(x, d);
    return x;
}

// Sum over the lanes up to and including this one.
uint subgroup_inclusive_sum(uint x) {
    [[unroll]] for (uint d = 1u; d < SUBGROUP; d *= 2u) {
        const uint lane = gl_SubgroupInvocationID;
        const uint below = subgroupShuffle(x, lane >= d ? lane - d : lane);
        x += lane >= d ? below : 0u;
    }
    return x;
}
#endif
