// SPDX-License-Identifier: Apache-2.0
// Splats to start from where there are no points, and a start of another SH degree.
#pragma once
#include <cstdint>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/gaussians.h"

namespace ewa::train {

/// The sphere that the cameras look into. Its centre is the point nearest to all optical axes in the
/// least-squares sense; its radius the mean distance of the cameras from it. Where the axes are parallel that
/// point is nowhere, and where the cameras look away from it they stand inside what they see; then the centre
/// is the cameras' mean position and the radius four times the distance of the farthest camera from it (1
/// where all cameras stand in one place).
struct Sphere {
    glm::dvec3 center{0.0};  // world
    double radius = 1;       // world units, positive
};
Sphere viewed_sphere(const Dataset& dataset, const std::vector<int>& frames);

/// `count` splats spread evenly over what the cameras see of viewed_sphere(frames): the part of it that lies
/// in at least one frustum. Where that part is too small to hit, a splat stands on a random ray of a camera,
/// at most the sphere's radius away. Grey with a little noise, scaled by their neighbours' distances as
/// gaussians_from_points does. Each is a pure function of seed and index. frames must not be empty.
Gaussians random_gaussians(const Dataset& dataset, const std::vector<int>& frames, int count, uint64_t seed,
                           int sh_degree);

/// The same splats with room for SH up to `degree`; coefficients above it are dropped, new ones are zero.
Gaussians with_sh_degree(const Gaussians& gaussians, int degree);

}  // namespace ewa::train
