// SPDX-License-Identifier: Apache-2.0
// The sum of a splat's gradient slots, in the order of its tiles. The including pass declares slots and sorted_indices, which
// SLOTS_EMITTED does not need.
#ifndef EWA_LIB_SLOTS
#define EWA_LIB_SLOTS
layout(constant_id = SPEC_SLOTS) const uint SLOTS = SLOTS_SORTED;

// whole: the slots have more than the first 9 floats; the others stay 0 without. Some drivers stop a loop after 65,535
// iterations, so an iteration adds 8 slots.
void sum_slots(uint first, uint count, const bool whole, out vec4 sum[SLOT_TEXELS]) {
    sum[0] = sum[1] = sum[2] = vec4(0.0);
    for (uint j = 0u; j < count; j += 8u) {
        [[unroll]] for (uint c = 0; c < 8; ++c) {
            const bool there = j + c < count;
            const uint instance = there ? first + j + c : first;
            const int slot = int(SLOT_TEXELS * (SLOTS == SLOTS_EMITTED ? instance : sorted_indices[instance]));
            const vec4 t0 = fetch(slots, slot), t1 = fetch(slots, slot + 1), t2 = fetch(slots, slot + 2);
            if (there) {
                sum[0] += t0;
                sum[1] += t1;
                if (whole) sum[2] += t2;
                else sum[2].x += t2.x;
            }
        }
    }
}
#endif
