// SPDX-License-Identifier: Apache-2.0
// Pairs of Sobol's first two dimensions, shuffled and Owen-scrambled by hashing (Burley 2020, "Practical Hash-based
// Owen Scrambling"). Every aligned block of 2^m samples is a (0, m, 2)-net, and different seeds are independent.
// src/core/random.h computes the same numbers.
#ifndef EWA_LIB_LOW_DISCREPANCY
#define EWA_LIB_LOW_DISCREPANCY
#include "lib/random.glsl"

uint laine_karras(uint x, uint seed) {
    x += seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return x;
}

// The second dimension's generator is Pascal's triangle modulo 2: i(x) becomes i(1 + x), a polynomial over GF(2).
uint pascal_shift(uint i) {
    i ^= (i & 0xffff0000u) >> 16u;
    i ^= (i & 0xff00ff00u) >> 8u;
    i ^= (i & 0xf0f0f0f0u) >> 4u;
    i ^= (i & 0xccccccccu) >> 2u;
    return i ^ ((i & 0xaaaaaaaau) >> 1u);
}

// In the open interval (0, 1). seed: three independent words.
vec2 sobol_pair(uint index, uvec3 seed) {
    const uint i = bitfieldReverse(laine_karras(bitfieldReverse(index), seed.x));
    const uvec2 bits = bitfieldReverse(uvec2(laine_karras(i, seed.y), laine_karras(pascal_shift(i), seed.z)));
    return (vec2(bits >> 8u) + 0.5) / 16777216.0;
}
#endif
