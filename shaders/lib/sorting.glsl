// SPDX-License-Identifier: Apache-2.0
// How the lanes of the radix sort divide the items: contiguous chunks of whole texels (4 items).
#ifndef EWA_LIB_SORTING
#define EWA_LIB_SORTING
layout(constant_id = SPEC_RADIX_BITS) const uint RADIX_BITS = 8;
const uint DIGITS = 1u << RADIX_BITS;

uint item_count(SortPush push, uint device_count) {
    const uint wanted = push.items > 0u ? push.items : device_count;
    return wanted <= push.capacity ? wanted : 0u;
}
uint chunk_texels(uint items, uint lanes) { return ((items + 3u) / 4u + lanes - 1u) / lanes; }
uint digit_of(uint key, uint shift) { return (key >> shift) & (DIGITS - 1u); }
#endif
