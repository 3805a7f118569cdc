// SPDX-License-Identifier: Apache-2.0
// Real spherical harmonics to degree 3, and degree 4 apart, in INRIA's order, and their derivatives by the unit direction.
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

// Degree 4 alone, coefficients 16 to 24.
void sh_band4(vec3 d, out float b[9]) {
    const float x = d.x, y = d.y, z = d.z, xx = x * x, yy = y * y, zz = z * z;
    b[0] = SH_C4_0 * x * y * (xx - yy);
    b[1] = SH_C4_1 * y * z * (3.0 * xx - yy);
    b[2] = SH_C4_2 * x * y * (6.0 * zz - xx - yy);
    b[3] = SH_C4_3 * y * z * (4.0 * zz - 3.0 * xx - 3.0 * yy);
    b[4] = SH_C4_4 * (8.0 * zz * (zz - 3.0 * (xx + yy)) + 3.0 * (xx + yy) * (xx + yy));
    b[5] = SH_C4_5 * x * z * (4.0 * zz - 3.0 * xx - 3.0 * yy);
    b[6] = SH_C4_6 * (xx - yy) * (6.0 * zz - xx - yy);
    b[7] = SH_C4_7 * x * z * (xx - 3.0 * yy);
    b[8] = SH_C4_8 * (xx * (xx - 3.0 * yy) - yy * (3.0 * xx - yy));
}

void sh_band4_gradient(vec3 d, out vec3 b[9]) {
    const float x = d.x, y = d.y, z = d.z, xx = x * x, yy = y * y, zz = z * z;
    b[0] = SH_C4_0 * vec3(y * (3.0 * xx - yy), x * (xx - 3.0 * yy), 0.0);
    b[1] = SH_C4_1 * vec3(6.0 * x * y * z, 3.0 * z * (xx - yy), y * (3.0 * xx - yy));
    b[2] = SH_C4_2 * vec3(y * (6.0 * zz - 3.0 * xx - yy), x * (6.0 * zz - xx - 3.0 * yy), 12.0 * x * y * z);
    b[3] = SH_C4_3 * vec3(-6.0 * x * y * z, z * (4.0 * zz - 3.0 * xx - 9.0 * yy), 3.0 * y * (4.0 * zz - xx - yy));
    b[4] = SH_C4_4 * vec3(12.0 * x * (xx + yy - 4.0 * zz), 12.0 * y * (xx + yy - 4.0 * zz),
                          16.0 * z * (2.0 * zz - 3.0 * (xx + yy)));
    b[5] = SH_C4_5 * vec3(z * (4.0 * zz - 9.0 * xx - 3.0 * yy), -6.0 * x * y * z, 3.0 * x * (4.0 * zz - xx - yy));
    b[6] = SH_C4_6 * vec3(4.0 * x * (3.0 * zz - xx), -4.0 * y * (3.0 * zz - yy), 12.0 * z * (xx - yy));
    b[7] = SH_C4_7 * vec3(3.0 * z * (xx - yy), -6.0 * x * y * z, x * (xx - 3.0 * yy));
    b[8] = SH_C4_8 * vec3(4.0 * x * (xx - 3.0 * yy), -4.0 * y * (3.0 * xx - yy), 0.0);
}
#endif
