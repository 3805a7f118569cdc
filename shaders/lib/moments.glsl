// SPDX-License-Identifier: Apache-2.0
// Adam's two moments of a value in one word (docs/numerics.md, "Moments in 16 bits"). Texels have one word a component.
// The upper half is the upper half of the first moment's float32. The lower half is the square root of the second
// moment, which is never negative: 7 bits of exponent and 9 of mantissa. A zero word holds two zeros.
#ifndef EWA_LIB_MOMENTS
#define EWA_LIB_MOMENTS
#include "lib/random.glsl"

const uint MOMENT_HIGH_HALF = 0xffff0000u;
// Smaller roots become zero: 2^-63, the root of the least normal float32.
const uint MOMENT_LEAST_ROOT = 64u << 23;
const uint MOMENT_ROOT_CUT = 14u; // bits of the root that are cut off

vec4 first_moment(uvec4 words) { return uintBitsToFloat(words & MOMENT_HIGH_HALF); }

vec4 second_moment(uvec4 words) {
    const uvec4 kept = words & ~MOMENT_HIGH_HALF;
    const vec4 root = uintBitsToFloat((kept << MOMENT_ROOT_CUT) + MOMENT_LEAST_ROOT);
    return mix(root * root, vec4(0.0), equal(kept, uvec4(0u)));
}

// Its square root.
vec4 second_root(uvec4 words) {
    const uvec4 kept = words & ~MOMENT_HIGH_HALF;
    const vec4 root = uintBitsToFloat((kept << MOMENT_ROOT_CUT) + MOMENT_LEAST_ROOT);
    return mix(vec4(0.0), root, notEqual(kept, uvec4(0u)));
}

// Rounds at random, up with the probability of the part that is cut off, so that the mean is exact.
// random: 16 bits for the first moment, 14 others for the second.
uvec4 pack_moments(vec4 first, vec4 second, uvec4 random) {
    const uvec4 high = (floatBitsToUint(first) + (random & 0xffffu)) & MOMENT_HIGH_HALF;
    const uvec4 bits = floatBitsToUint(sqrt(second));
    const uvec4 root = bits - min(bits, uvec4(MOMENT_LEAST_ROOT));
    return high | ((root + (random >> 18u)) >> MOMENT_ROOT_CUT);
}

// The random bits of one texel: a pure function of seed, step, splat and plane.
uvec4 moment_random(uint splat, uint plane, uint step, uint seed[2]) {
    return pcg4d(uvec4(splat, step, seed[0], seed[1] ^ (MOMENT_STREAM + plane)));
}
#endif
