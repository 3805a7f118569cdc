// SPDX-License-Identifier: Apache-2.0
// Real spherical harmonics of degree 0..3 as polynomials of a unit direction, in INRIA's order and signs
// (Sloan, "Efficient Spherical Harmonic Evaluation", JCGT 2013; 3DGS, utils/sh_utils.py).
#pragma once
#include <array>
#include <glm/vec3.hpp>

#include "ewa/gaussians.h"
#include "shared/constants.h"

namespace ewa::scene {

inline constexpr size_t kMaxShCoefficients = sh_coefficients(kMaxShDegree);

/// Y_j(direction) for j < (degree + 1)^2; the rest is zero. They are orthonormal over the sphere.
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

}  // namespace ewa::scene
