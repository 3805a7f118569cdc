// SPDX-License-Identifier: Apache-2.0
// How a radix sort divides the items: each lane has a contiguous chunk of whole texels (4 items), or, where keys are ranked
// in shared memory, each workgroup has RANKED_KEYS. The ranked passes include subgroup.glsl before this file.
#ifndef EWA_LIB_SORTING
#define EWA_LIB_SORTING
layout(constant_id = SPEC_RADIX_BITS) const uint RADIX_BITS = 8;
const uint DIGITS = 1u << RADIX_BITS;

uint item_count(SortPush push, uint device_count) {
    const uint wanted = push.items > 0u ? push.items : device_count;
    return wanted <= push.capacity ? wanted : 0u;
}
uint chunk_texels(uint items, uint lanes) { return ((items + 3u) / 4u + lanes - 1u) / lanes; }
#ifdef EWA_LIB_SUBGROUP
const uint RANKED_ROUNDS = RANKED_LANE_KEYS / (SUBGROUP > 32u ? 2u : 1u);  // keys of an invocation
const uint RANKED_KEYS = RANKED_ROUNDS * GROUP_SIZE;
#endif
uint digit_of(uint key, uint shift) { return (key >> shift) & (DIGITS - 1u); }
#endif
