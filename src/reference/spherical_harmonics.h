// Real spherical harmonics of degree 0..3 as polynomials of a unit direction, in INRIA's order and signs
// (Sloan, "Efficient Spherical Harmonic Evaluation", JCGT 2013; 3DGS, utils/sh_utils.py).
#pragma once
#include <array>
#include <glm/vec3.hpp>

#include "reference/values.h"

namespace ewa::reference {

/// Y_j(direction) for j < (degree + 1)^2; the rest is zero.
std::array<double, kMaxCoefficients> sh_basis(int degree, const glm::dvec3& direction);

/// dY_j/d(x, y, z) of the polynomials, x, y and z taken as independent. The part along the direction drops
/// out when the caller goes on through the normalisation.
std::array<glm::dvec3, kMaxCoefficients> sh_basis_gradient(int degree, const glm::dvec3& direction);

}  // namespace ewa::reference
