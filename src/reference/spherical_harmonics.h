// SPDX-License-Identifier: Apache-2.0
// The spherical harmonics of scene/sh_basis.h and their derivatives.
#pragma once
#include <array>
#include <glm/vec3.hpp>

#include "reference/values.h"
#include "scene/sh_basis.h"

namespace ewa::reference {

using scene::sh_basis;

/// dY_j/d(x, y, z) of the polynomials, x, y and z taken as independent. The part along the direction drops
/// out when the caller goes on through the normalisation.
std::array<glm::dvec3, kMaxCoefficients> sh_basis_gradient(int degree, const glm::dvec3& direction);

}  // namespace ewa::reference
