// SPDX-License-Identifier: Apache-2.0
// Groups of splats that touch, and the number of cameras that see each splat. Cleaning a scene uses both.
#pragma once
#include <cstdint>
#include <vector>

#include "ewa/camera.h"
#include "ewa/gaussians.h"

namespace ewa::scene {

struct SplatGroups {
    std::vector<uint32_t> of;  // the group of each splat
    /// Splats in each group. The largest comes first, then by the lowest index of a splat.
    std::vector<uint32_t> sizes;
};

/// Groups of splats that touch. Two splats touch if their largest standard deviations differ by less than a factor of 2, and d' (Σa
/// + Σb)^-1 d < 9 for the difference d of their means: 3 standard deviations of the difference of a point of each. The limit on
/// sizes keeps a huge splat in the background from joining small groups that float in it. Each splat is compared with its 32
/// nearest of about its size. If several splats of an octave of sizes have the same mean, only the first is compared. A splat that
/// is not drawable is a group of its own. O(n log n).
SplatGroups touching_groups(const Gaussians& gaussians);

/// For each splat, whether it is one of `some` (of size()), or its mean is within `radius` of the mean of one of them. O(n log n).
std::vector<bool> splats_near(const Gaussians& gaussians, const std::vector<bool>& some, double radius);

/// For each splat, the number of cameras with its mean in their image, beyond the near plane. Occlusion by other splats does not
/// count. Lenses must be native (is_native).
std::vector<uint32_t> views_of_splats(const Gaussians& gaussians, const std::vector<Camera>& cameras);

}  // namespace ewa::scene
