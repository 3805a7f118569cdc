// SPDX-License-Identifier: Apache-2.0
// The sphere that the cameras of a dataset look at.
#pragma once
#include <glm/vec3.hpp>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::train {

/// The unit vector in the world along which a camera looks.
glm::dvec3 viewing_direction(const Camera& camera);

/// The sphere that the cameras look at. Its centre is the point nearest to all optical axes in the least-squares sense. Its radius
/// is the mean distance of the cameras from it. If the axes are parallel or the cameras look away from that point, the centre is
/// the cameras' mean position, and the radius is four times the distance of the farthest camera from it (1 if all cameras
/// coincide).
struct Sphere {
    glm::dvec3 center{0.0};  // world
    double radius = 1;       // world units, positive
};
Sphere viewed_sphere(const Dataset& dataset, const std::vector<int>& frames);

}  // namespace ewa::train
