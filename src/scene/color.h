// SPDX-License-Identifier: Apache-2.0
// Colour: the spherical harmonics of view-dependent colour, and sRGB's curve.
#pragma once
#include <array>
#include <cmath>
#include <glm/vec3.hpp>

#include "ewa/gaussians.h"
#include "shared/constants.h"

namespace ewa::scene {

inline constexpr size_t kMaxShCoefficients = sh_coefficients(kMaxShDegree);

/// The real spherical harmonics Y_j(direction) for j < (degree + 1)^2, and zero above. The direction is a
/// unit vector. They are orthonormal over the sphere, in INRIA's order and signs (3DGS, utils/sh_utils.py;
/// Sloan, "Efficient Spherical Harmonic Evaluation", JCGT 2013).
inline std::array<double, kMaxShCoefficients> sh_basis(int degree, const glm::dvec3& direction) {
    using namespace shared;
    const double x = direction.x, y = direction.y, z = direction.z;
    std::array<double, kMaxShCoefficients> basis{};
    basis[0] = SH_C0;
    if (degree < 1) return basis;
    basis[1] = -SH_C1 * y;
    basis[2] = SH_C1 * z;
    basis[3] = -SH_C1 * x;
    if (degree < 2) return basis;
    basis[4] = SH_C2_0 * x * y;
    basis[5] = SH_C2_1 * y * z;
    basis[6] = SH_C2_2 * (2 * z * z - x * x - y * y);
    basis[7] = SH_C2_3 * x * z;
    basis[8] = SH_C2_4 * (x * x - y * y);
    if (degree < 3) return basis;
    basis[9] = SH_C3_0 * y * (3 * x * x - y * y);
    basis[10] = SH_C3_1 * x * y * z;
    basis[11] = SH_C3_2 * y * (4 * z * z - x * x - y * y);
    basis[12] = SH_C3_3 * z * (2 * z * z - 3 * x * x - 3 * y * y);
    basis[13] = SH_C3_4 * x * (4 * z * z - x * x - y * y);
    basis[14] = SH_C3_5 * z * (x * x - y * y);
    basis[15] = SH_C3_6 * x * (x * x - 3 * y * y);
    return basis;
}

/// sRGB's curve (IEC 61966-2-1) for v >= 0, and its inverse.
inline double srgb_of_linear(double v) {
    return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
}
inline double linear_of_srgb(double v) {
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

}  // namespace ewa::scene
