// SPDX-License-Identifier: Apache-2.0
// Real spherical harmonics to degree 3 in INRIA's order, and their derivatives by the unit direction.
#ifndef EWA_LIB_SH
#define EWA_LIB_SH

void sh_basis(uint degree, vec3 d, out float b[16]) {
    const float x = d.x, y = d.y, z = d.z;
    [[unroll]] for (int k = 0; k < 16; ++k) b[k] = 0.0;
    b[0] = SH_C0;
    if (degree >= 1u) {
        b[1] = -SH_C1 * y;
        b[2] = SH_C1 * z;
        b[3] = -SH_C1 * x;
    }
    if (degree >= 2u) {
        b[4] = SH_C2_0 * x * y;
        b[5] = SH_C2_1 * y * z;
        b[6] = SH_C2_2 * (2.0 * z * z - x * x - y * y);
        b[7] = SH_C2_3 * x * z;
        b[8] = SH_C2_4 * (x * x - y * y);
    }
    if (degree >= 3u) {
        b[9] = SH_C3_0 * y * (3.0 * x * x - y * y);
        b[10] = SH_C3_1 * x * y * z;
        b[11] = SH_C3_2 * y * (4.0 * z * z - x * x - y * y);
        b[12] = SH_C3_3 * z * (2.0 * z * z - 3.0 * x * x - 3.0 * y * y);
        b[13] = SH_C3_4 * x * (4.0 * z * z - x * x - y * y);
        b[14] = SH_C3_5 * z * (x * x - y * y);
        b[15] = SH_C3_6 * x * (x * x - 3.0 * y * y);
    }
}

// d(basis k)/d(direction), as the polynomial's gradient (the caller projects it onto the sphere).
void sh_basis_gradient(uint degree, vec3 d, out vec3 b[16]) {
    const float x = d.x, y = d.y, z = d.z;
    [[unroll]] for (int k = 0; k < 16; ++k) b[k] = vec3(0.0);
    if (degree >= 1u) {
        b[1] = vec3(0.0, -SH_C1, 0.0);
        b[2] = vec3(0.0, 0.0, SH_C1);
        b[3] = vec3(-SH_C1, 0.0, 0.0);
    }
    if (degree >= 2u) {
        b[4] = SH_C2_0 * vec3(y, x, 0.0);
        b[5] = SH_C2_1 * vec3(0.0, z, y);
        b[6] = SH_C2_2 * vec3(-2.0 * x, -2.0 * y, 4.0 * z);
        b[7] = SH_C2_3 * vec3(z, 0.0, x);
        b[8] = SH_C2_4 * vec3(2.0 * x, -2.0 * y, 0.0);
    }
    if (degree >= 3u) {
        b[9] = SH_C3_0 * vec3(6.0 * x * y, 3.0 * x * x - 3.0 * y * y, 0.0);
        b[10] = SH_C3_1 * vec3(y * z, x * z, x * y);
        b[11] = SH_C3_2 * vec3(-2.0 * x * y, 4.0 * z * z - x * x - 3.0 * y * y, 8.0 * y * z);
        b[12] = SH_C3_3 * vec3(-6.0 * x * z, -6.0 * y * z, 6.0 * z * z - 3.0 * x * x - 3.0 * y * y);
        b[13] = SH_C3_4 * vec3(4.0 * z * z - 3.0 * x * x - y * y, -2.0 * x * y, 8.0 * x * z);
        b[14] = SH_C3_5 * vec3(2.0 * x * z, -2.0 * y * z, x * x - y * y);
        b[15] = SH_C3_6 * vec3(3.0 * x * x - 3.0 * y * y, -6.0 * x * y, 0.0);
    }
}
#endif
