// SPDX-License-Identifier: Apache-2.0
// Distances in a point cloud.
#pragma once
#include <glm/vec3.hpp>
#include <vector>

namespace ewa::scene {

/// Per point the mean squared distance to its 3 nearest other points (fewer where there are fewer; -1 for a
/// single point). Points at the same place are neighbours at distance 0. All coordinates finite. O(n log n).
std::vector<double> mean_squared_neighbor_distance(const std::vector<glm::dvec3>& positions);

}  // namespace ewa::scene
