// SPDX-License-Identifier: Apache-2.0
// The covariance of a splat, and the quaternion and scales of a covariance.
#pragma once
#include <cstddef>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>

#include "ewa/gaussians.h"

namespace ewa::scene {

/// Singular value decomposition A = U diag(s) V^T by one-sided Jacobi rotations (Hestenes 1958). U's columns
/// are the rotated columns of A divided by their lengths.
struct Decomposition {
    glm::dmat3 u{1.0};
    glm::dvec3 s{0.0};
    glm::dmat3 v{1.0};
};

Decomposition decompose(glm::dmat3 a);

/// Throws InputError unless the transform is finite and affine, and does not flatten space.
void check_transform(const glm::dmat4& matrix);

/// Replaces columns of length 0 so that the three are a right-handed orthonormal frame. An axis may change
/// its sign, which does not change the covariance.
glm::dmat3 right_handed(glm::dmat3 u);

/// The covariance of splat i, in squared world units. The splat must be drawable.
glm::dmat3 covariance_of(const Gaussians& gaussians, size_t i);

/// Sets the quaternion and the scales of splat i to those of a covariance. Axes that are flatter than a millionth of the longest
/// get that length.
void set_covariance(Gaussians& gaussians, size_t i, const glm::dmat3& covariance);

}  // namespace ewa::scene
