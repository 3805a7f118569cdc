// SPDX-License-Identifier: Apache-2.0
// Edits of a whole splat scene. All throw InputError for arrays of a wrong length, see check() of ewa/gaussians.h.
#pragma once
#include <cstdint>
#include <functional>
#include <glm/mat4x4.hpp>
#include <string>
#include <vector>

#include "ewa/gaussians.h"
#include "ewa/sky_map.h"

namespace ewa {

/// Applies an affine transform p -> M p + t to column vectors in world units. The last row must be 0 0 0 1.
/// Covariances become M Sigma M^T. Rotations and uniform scales change quaternions and scales directly; for
/// other transforms, each covariance is decomposed. View-dependent colour turns with the orthogonal part of
/// M, including mirrors. A turn by a multiple of 90 degrees about an axis is exact in means and SH. Throws
/// InputError if the matrix is not finite, is not affine or flattens space.
void transform_splats(Gaussians& gaussians, const glm::dmat4& matrix);

/// Replaces the scene by the splats of `indices`, in that order. Each index is < size and may be repeated. Throws InputError.
void select_splats(Gaussians& gaussians, const std::vector<uint32_t>& indices);

/// Removes all splats but those of `indices`, in place, without memory for a copy. The indices ascend without repetition. Throws
/// InputError.
void keep_splats(Gaussians& gaussians, const std::vector<uint32_t>& indices);

/// Sets the SH degree (0..3). Higher coefficients are cut, new ones are zero. Throws InputError for another degree.
void set_sh_degree(Gaussians& gaussians, int degree);

/// Merges near splats until `target` of them are left, at least one. A merged splat has the mean, covariance and colour of both
/// splats' contributions, and as much of their opacity as one splat can have. Each round merges the pairs of the least relative
/// error. Splats that are not drawable are removed first. The others come in about Morton order. The same scene gives the same
/// splats. The time is O(n log n), and the memory beside the scene about 110 bytes a splat. progress: called after each round, with
/// the number of splats that are left.
void decimate_splats(Gaussians& gaussians, size_t target, const std::function<void(size_t)>& progress = {});

/// Appends the splats of `more`. The SH degree becomes the larger of both. If only one of them has opacities of
/// Footprint::density, these are fitted to the other kernels.
void append_splats(Gaussians& gaussians, const Gaussians& more);

/// Opaque splats in the colours of the sky, one for each texel, on a sphere around the scene with 30 times the scene's radius. They
/// stand for the sky in viewers that have none. World frame of `scene`. Throws InputError also for a sky of a wrong size.
Gaussians sky_splats(const SkyMap& sky, const Gaussians& scene);

/// Converts the opacities to those of Footprint::density, or from them to those of the other kernels, so that renders
/// look about the same. Does nothing if Gaussians::density is `density` already. Converting back gives the same values, up to
/// float32's rounding.
void fit_opacities(Gaussians& gaussians, bool density);

/// The splat indices in Morton order: along a Z-order curve with 21 bits per axis over the bounds of the
/// finite means. Ties are in order of the index. Splats without a finite mean come last.
std::vector<uint32_t> morton_order(const Gaussians& gaussians);

}  // namespace ewa
