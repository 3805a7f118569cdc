// SPDX-License-Identifier: Apache-2.0
// How published benchmarks of surfaces measure meshes.
#pragma once
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "mesh/distance.h"

namespace ewa::mesh {

struct Protocol {
    double spacing = 0;                              // of the points on a mesh, world units
    std::optional<double> threshold = std::nullopt;  // of the F-score
    double farthest = kAllDistances;                 // distances from here on are no part of the means
    double cell = 0;  // side of a cube in which the points of a scan become one; 0: all count
};

/// "dtu": 0.2 mm between points, distances up to 20 mm, in mm. "tanks-and-temples:SCENE": the threshold of a scene of the training set,
/// half of it between points. Throws InputError.
Protocol protocol_named(const std::string& name);

/// How many points lie on a mesh at this distance from each other: one a square of that side. At least 1. Throws InputError above 100 M.
size_t points_at(const Surface& mesh, double spacing);

/// The means of the points in each cube of this side, in an order that depends on nothing but the cubes.
std::vector<glm::dvec3> thinned(const std::vector<glm::dvec3>& points, double cell);

}  // namespace ewa::mesh
