// SPDX-License-Identifier: Apache-2.0
// Index of a splat's parameters (shared/layouts.h).
#ifndef EWA_LIB_PARAMS
#define EWA_LIB_PARAMS
// Texel of plane `plane` of splat i, with `planes` planes stored a splat.
uint param_texel(uint planes, uint plane, uint i) {
    return (i / PARAM_BLOCK * planes + plane) * PARAM_BLOCK + i % PARAM_BLOCK;
}

// Whether a splat is frozen, by a texel of its moments.
bool is_frozen(uvec4 moments) { return moments.x == FROZEN_MOMENT; }
#endif
