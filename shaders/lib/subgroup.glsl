// SPDX-License-Identifier: Apache-2.0
// Sums over a subgroup by shuffles with constant distances. They cost next to nothing where
// subgroup arithmetic is slow.
#ifndef EWA_LIB_SUBGROUP
#define EWA_LIB_SUBGROUP
layout(constant_id = SPEC_SUBGROUP) const uint SUBGROUP = 8;

#ifdef EWA_EMULATE_SUBGROUPS
// For tests of more lanes than the device has: a subgroup is SUBGROUP neighbouring invocations of a workgroup, which meet in
// shared memory. All invocations of the workgroup must take part.
#define LANE (gl_LocalInvocationID.x % SUBGROUP)
#define SUBGROUP_INDEX (gl_LocalInvocationID.x / SUBGROUP)
shared uint meeting[GROUP_SIZE];
uint met(uint x, uint lane) {
    barrier();
    meeting[gl_LocalInvocationID.x] = x;
    barrier();
    return meeting[SUBGROUP_INDEX * SUBGROUP + lane];
}
float met(float x, uint lane) { return uintBitsToFloat(met(floatBitsToUint(x), lane)); }
// Without a loop over the lanes: lavapipe ends an invocation's loops after 65,535 iterations of all together.
bool all_met(bool x) {
    barrier();
    meeting[gl_LocalInvocationID.x] = 1u;
    barrier();
    if (!x) meeting[SUBGROUP_INDEX * SUBGROUP] = 0u;
    barrier();
    return meeting[SUBGROUP_INDEX * SUBGROUP] != 0u;
}
#define subgroupShuffle(X, OTHER) met(X, OTHER)
#define subgroupShuffleXor(X, MASK) met(X, LANE ^ (MASK))
#define subgroupAll(X) all_met(X)
#define subgroupBarrier() barrier()
#define subgroupMemoryBarrierShared() memoryBarrierShared()
#else
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_shuffle : require
#define LANE gl_SubgroupInvocationID
#define SUBGROUP_INDEX gl_SubgroupID
#endif

// Steps of doubling distance, up to 64 lanes. The loops below count up by one and stop by a constant condition: some
// compilers do not unroll a loop that doubles its counter, and its iterations count towards a driver's limit.
const uint DOUBLINGS = 6u;

float subgroup_sum(float x) {
    [[unroll]] for (uint s = 0u; s < DOUBLINGS; ++s) {
        if ((1u << s) < SUBGROUP) x += subgroupShuffleXor(x, 1u << s);
    }
    return x;
}

// Turns of a scan whose loads are on their way together. A GPU waits long for each; a CPU does not.
#ifdef EWA_TEXEL_BUFFERS
const uint SCAN_AHEAD = 1u;
#else
const uint SCAN_AHEAD = 8u;
#endif
const uint SCANNED = SCAN_AHEAD * SUBGROUP;  // entries of these turns

// Sum over lanes 0 to this one, inclusive.
uint subgroup_inclusive_sum(uint x) {
    const uint lane = LANE;
    [[unroll]] for (uint s = 0u; s < DOUBLINGS; ++s) {
        if ((1u << s) < SUBGROUP) {
            const uint below = subgroupShuffle(x, lane >= (1u << s) ? lane - (1u << s) : lane);
            x += lane >= (1u << s) ? below : 0u;
        }
    }
    return x;
}
#endif
