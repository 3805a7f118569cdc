// SPDX-License-Identifier: Apache-2.0
// Distances in a point cloud.
#pragma once
#include <glm/vec3.hpp>
#include <vector>

namespace ewa::scene {

/// The mean squared distance of each point to its 3 nearest other points, or to all others if there are
/// fewer. -1 for a single point. Points at the same position are neighbours at distance 0. All coordinates
/// must be finite. O(n log n).
std::vector<double> mean_squared_neighbor_distance(const std::vector<glm::dvec3>& positions);

}  // namespace ewa::scene
