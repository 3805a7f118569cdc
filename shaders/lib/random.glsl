// SPDX-License-Identifier: Apache-2.0
// Counter-based random numbers: a pure function of the counter. src/core/random.h computes the same numbers.
// pcg4d is from Jarzynski and Olano 2020, "Hash Functions for GPU Rendering".
#ifndef EWA_LIB_RANDOM
#define EWA_LIB_RANDOM
uvec4 pcg4d(uvec4 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v = v ^ (v >> 16u);
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// In the open interval (0, 1).
vec4 uniform4(uvec4 counter) { return (vec4(pcg4d(counter) >> 8u) + 0.5) / 16777216.0; }

// Three independent standard normal numbers (Box and Muller 1958).
vec3 normal3(uvec4 counter) {
    const vec4 u = uniform4(counter);
    const float r0 = sqrt(-2.0 * log(u.x)), r1 = sqrt(-2.0 * log(u.z));
    const float turn = 6.283185307179586;
    return vec3(r0 * cos(turn * u.y), r0 * sin(turn * u.y), r1 * cos(turn * u.w));
}
#endif
