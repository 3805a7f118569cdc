#version 460
// SPDX-License-Identifier: Apache-2.0
// Moves the pairs of a radix pass, for devices with fast shared memory. The sort is stable.
// One workgroup owns the same block of keys as in radix_count_ranked, and each of its subgroups a contiguous part. Lanes
// with the same digit find each other by ballots, so a key knows its rank among the block's keys of its digit. The block is
// sorted in shared memory first: neighbouring invocations then write to neighbouring places.
// counters[digit * blocks + block] is the block's first place within the digit; bases[digit] is where the digit begins. With
// SORT_FEW the block finds both: it adds up the blocks' counts, which are then the counters.
// SPEC_MODE: SORT_* bits.
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"
#include "lib/sorting.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool OWN_INDICES = (MODE & SORT_OWN_INDICES) != 0u, DROP_KEYS = (MODE & SORT_DROP_KEYS) != 0u,
           TRACKED = (MODE & SORT_TRACKED) != 0u, FIRST = (MODE & SORT_FIRST) != 0u, LAST = (MODE & SORT_LAST) != 0u,
           FEW = (MODE & SORT_FEW) != 0u;

WORDS(0, keys);
WORDS(1, values);
layout(set = 0, binding = 2, scalar) readonly buffer Counters { uint counters[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Bases { uint bases[]; };
layout(set = 0, binding = 4, scalar) readonly buffer CountsBlock { Counts counts; };
layout(set = 0, binding = 5, scalar) writeonly buffer KeysOut { uint keys_out[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer ValuesOut { uint values_out[]; };
WORDS(7, indices);
layout(set = 0, binding = 8, scalar) writeonly buffer IndicesOut { uint indices_out[]; };
layout(push_constant, scalar) uniform Push { SortPush push; };

shared uint own_counts[GROUP_SIZE / SUBGROUP * DIGITS];  // of each subgroup: keys of a digit; later, those of the subgroups before
// Where a digit begins in the sorted block; with SORT_FEW then where it begins among all keys.
shared uint digit_starts[FEW ? 2u * DIGITS : DIGITS];
shared uint places_before[FEW ? DIGITS : 1u];            // keys of a digit in the blocks before
shared uint exchange[RANKED_KEYS];

// Position of round `round` of this invocation: in the block as it was read, and in the sorted block.
uint read_at(uint round) { return (SUBGROUP_INDEX * RANKED_ROUNDS + round) * SUBGROUP + LANE; }
uint write_at(uint round) { return round * GROUP_SIZE + SUBGROUP_INDEX * SUBGROUP + LANE; }

// Number of keys of this digit in the subgroup's rounds so far, and in the lanes below. Counts this round's keys.
uint rank_of(uint digit, bool present) {
    uvec4 same = subgroupBallot(present);
    [[unroll]] for (uint b = 0u; b < RADIX_BITS; ++b) {
        const bool set = ((digit >> b) & 1u) != 0u;
        const uvec4 votes = subgroupBallot(set);
        same &= set ? votes : ~votes;
    }
    const uint below = subgroupBallotExclusiveBitCount(same), counter = SUBGROUP_INDEX * DIGITS + digit;
    const uint before = own_counts[counter];
    subgroupMemoryBarrierShared();
    subgroupBarrier();
    if (present && below == 0u) own_counts[counter] = before + subgroupBallotBitCount(same);
    subgroupMemoryBarrierShared();
    subgroupBarrier();
    return before + below;
}

// Adds up the counts of all blocks, and of those before this one. The loads of some blocks are on their way together.
const uint BLOCKS_AHEAD = 8u;
void add_blocks(uint block, uint blocks) {
    for (uint d = gl_LocalInvocationID.x; d < DIGITS; d += GROUP_SIZE) {
        uint before = 0u, all = 0u;
        for (uint first = 0u; first < blocks; first += BLOCKS_AHEAD) {
            uint count[BLOCKS_AHEAD];
            [[unroll]] for (uint a = 0; a < BLOCKS_AHEAD; ++a) {
                count[a] = 0u;
                if (first + a < blocks) count[a] = counters[(first + a) * DIGITS + d];
            }
            [[unroll]] for (uint a = 0; a < BLOCKS_AHEAD; ++a) {
                all += count[a];
                if (first + a < block) before += count[a];
            }
        }
        digit_starts[DIGITS + d] = all;
        places_before[d] = before;
    }
}

// Turns own_counts into sums over the subgroups before, and fills digit_starts.
void scan_counts() {
    const uint lane = LANE;
    for (uint d = SUBGROUP_INDEX * SUBGROUP + lane; d < DIGITS; d += GROUP_SIZE) {
        uint sum = 0u;
        for (uint s = 0u; s < GROUP_SIZE / SUBGROUP; ++s) {
            const uint own = own_counts[s * DIGITS + d];
            own_counts[s * DIGITS + d] = sum;
            sum += own;
        }
        digit_starts[d] = sum;
    }
    barrier();
    if (SUBGROUP_INDEX < (FEW ? 2u : 1u)) {
        const uint first = SUBGROUP_INDEX * DIGITS;
        uint carry = 0u;
        for (uint base = 0u; base < DIGITS; base += SUBGROUP) {
            const uint value = base + lane < DIGITS ? digit_starts[first + base + lane] : 0u;
            const uint sum = subgroup_inclusive_sum(value);
            if (base + lane < DIGITS) digit_starts[first + base + lane] = carry + sum - value;
            carry += subgroupShuffle(sum, SUBGROUP - 1u);
        }
    }
    barrier();
}

void main() {
    const uint block = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (block >= push.lanes) return;
    const uint begin = block * RANKED_KEYS, all = item_count(push, counts.instances);
    const uint items = all > begin ? min(all - begin, RANKED_KEYS) : 0u;  // of this block
    if (FEW && items == 0u) return;
    for (uint c = gl_LocalInvocationID.x; c < GROUP_SIZE / SUBGROUP * DIGITS; c += GROUP_SIZE) own_counts[c] = 0u;
    barrier();
    uint key[RANKED_ROUNDS], place[RANKED_ROUNDS];
    // All keys are on their way before the first barrier, which no load passes.
    [[unroll]] for (uint r = 0; r < RANKED_ROUNDS; ++r) key[r] = fetch_word(keys, begin + min(read_at(r), max(items, 1u) - 1u));
    if (FEW) add_blocks(block, (all + RANKED_KEYS - 1u) / RANKED_KEYS);
    [[unroll]] for (uint r = 0; r < RANKED_ROUNDS; ++r) place[r] = rank_of(digit_of(key[r], push.shift), read_at(r) < items);
    barrier();
    scan_counts();
    [[unroll]] for (uint r = 0; r < RANKED_ROUNDS; ++r) {
        const uint digit = digit_of(key[r], push.shift);
        place[r] += digit_starts[digit] + own_counts[SUBGROUP_INDEX * DIGITS + digit];
        if (read_at(r) < items) exchange[place[r]] = key[r];
    }
    barrier();
    uint to[RANKED_ROUNDS];
    [[unroll]] for (uint r = 0; r < RANKED_ROUNDS; ++r) {
        if (write_at(r) < items) {
            const uint sorted = exchange[write_at(r)], digit = digit_of(sorted, push.shift);
            const uint first = FEW ? digit_starts[DIGITS + digit] + places_before[digit]
                                   : bases[digit] + counters[digit * push.lanes + block];
            to[r] = first + write_at(r) - digit_starts[digit];
            if (!DROP_KEYS) keys_out[to[r]] = sorted;
        }
    }
    barrier();
    [[unroll]] for (uint r = 0; r < RANKED_ROUNDS; ++r) {
        const uint at = begin + read_at(r);
        if (read_at(r) < items) exchange[place[r]] = OWN_INDICES ? at : fetch_word(values, at);
    }
    barrier();
    [[unroll]] for (uint r = 0; r < RANKED_ROUNDS; ++r) {
        if (write_at(r) < items) values_out[to[r]] = exchange[write_at(r)];
    }
    if (!TRACKED) return;
    barrier();
    [[unroll]] for (uint r = 0; r < RANKED_ROUNDS; ++r) {
        const uint at = begin + read_at(r);
        if (read_at(r) < items) exchange[place[r]] = FIRST ? at : fetch_word(indices, at);
    }
    barrier();
    [[unroll]] for (uint r = 0; r < RANKED_ROUNDS; ++r) {
        if (write_at(r) < items) {
            const uint index = exchange[write_at(r)];
            indices_out[LAST ? index : to[r]] = LAST ? to[r] : index;
        }
    }
}
