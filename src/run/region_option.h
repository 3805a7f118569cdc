// SPDX-License-Identifier: Apache-2.0
// The option --region: the box in which splats are cloned, split or copied.
#pragma once
#include <glm/vec3.hpp>

#include "ewa/gaussians.h"
#include "run/run_option.h"

namespace ewa::train {

RunOption region_option();

/// Whether the region holds the point, in world units. Without a region, every point counts.
bool in_region(const TrainOptions& options, const glm::dvec3& point);

/// Throws InputError if no first splat is in the region.
void check_region(const TrainOptions& options, const Gaussians& start);

}  // namespace ewa::train
