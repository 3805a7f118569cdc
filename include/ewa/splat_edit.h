// SPDX-License-Identifier: Apache-2.0
// Changing a splat scene as a whole.
#pragma once
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <string>
#include <vector>

#include "ewa/gaussians.h"

namespace ewa {

/// The scene seen after p -> linear part of `matrix` * p + its translation (column vectors, world units; the
/// last row must be 0 0 0 1). Covariances become M Sigma M^T: rotations and uniform scales turn quaternions
/// and scales, anything else is decomposed anew. View-dependent colour turns with the orthogonal part of M,
/// mirrors included. A turn by a multiple of 90 degrees about an axis is exact in means and SH. Throws
/// InputError when the matrix is not finite, not affine or flattens space.
void transform_splats(Gaussians& gaussians, const glm::dmat4& matrix);

/// Keeps the splats of `indices` (each < size), in that order; what is repeated is repeated.
void select_splats(Gaussians& gaussians, const std::vector<uint32_t>& indices);

/// Cuts or fills with zeros up to the degree (0..3).
void set_sh_degree(Gaussians& gaussians, int degree);

/// Behind those of `gaussians`; the degree becomes the larger of both.
void append_splats(Gaussians& gaussians, const Gaussians& more);

/// The splats along a Z-order curve of 21 bits an axis over the bounds of the finite means, ties and splats
/// without a finite mean (last) by index. Neighbours in the list are neighbours in space.
std::vector<uint32_t> morton_order(const Gaussians& gaussians);

}  // namespace ewa
