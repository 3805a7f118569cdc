// SPDX-License-Identifier: Apache-2.0
// The ground of a scene, and the transform that makes it level.
#pragma once
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <optional>
#include <vector>

#include "ewa/gaussians.h"
#include "scene/planes.h"

namespace ewa::edit {

/// The rotation and translation that make a plane y = 0 with its normal along -y. plane.at keeps its x and z.
glm::dmat4 level_plane(const scene::Plane& plane);

/// level_plane() of the ground: the plane with the most splats among those that are at most 40 degrees from level and have few
/// splats below. states: of the splats; deleted and hidden ones do not count, nor almost transparent ones. up: world, of unit length.
/// Empty if less than a tenth of the splats are on such a plane.
std::optional<glm::dmat4> level_ground(const Gaussians& splats, const std::vector<uint8_t>& states,
                                       const glm::dvec3& up);

}  // namespace ewa::edit
