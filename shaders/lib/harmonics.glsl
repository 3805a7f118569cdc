// SPDX-License-Identifier: Apache-2.0
// Spherical harmonics to degree SPEC_SH_DEGREE, at most 4. Needs sh.glsl.
#ifndef EWA_LIB_HARMONICS
#define EWA_LIB_HARMONICS
layout(constant_id = SPEC_SH_DEGREE) const uint SH_DEGREE = 3;
const uint BASES = (SH_DEGREE + 1) * (SH_DEGREE + 1);

// Divides by the largest component first, so that squares neither overflow nor underflow. Zero stays zero.
vec3 unit_direction(vec3 d, out float norm) {
    const float largest = max(max(abs(d.x), abs(d.y)), abs(d.z));
    const vec3 scaled = d / largest;
    const float scaled_norm = length(scaled);
    norm = largest * scaled_norm;
    return largest == 0.0 ? vec3(0.0) : scaled / scaled_norm;
}

void harmonics_basis(vec3 direction, out float b[25]) {
    float low[16], high[9];
    sh_basis(SH_DEGREE, direction, low);
    sh_band4(direction, high);
    [[unroll]] for (uint k = 0; k < 16; ++k) b[k] = low[k];
    [[unroll]] for (uint k = 0; k < 9; ++k) b[16 + k] = high[k];
}

void harmonics_basis_gradient(vec3 direction, out vec3 b[25]) {
    vec3 low[16], high[9];
    sh_basis_gradient(SH_DEGREE, direction, low);
    sh_band4_gradient(direction, high);
    [[unroll]] for (uint k = 0; k < 16; ++k) b[k] = low[k];
    [[unroll]] for (uint k = 0; k < 9; ++k) b[16 + k] = high[k];
}
#endif
