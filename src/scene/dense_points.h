// SPDX-License-Identifier: Apache-2.0
// A denser point cloud to start a training from.
#pragma once
#include <cstddef>
#include <functional>
#include <glm/vec3.hpp>

#include "ewa/dataset.h"

namespace ewa::scene {

/// Returns `points`, followed by midpoints between neighbours: between each point and the two points nearest to it. A midpoint has
/// the mean of both colours. With more than `most` points in all, only the midpoints of the longest distances are added. `points`
/// must be finite, and have a colour each. wanted: whether a midpoint may be added; empty: all may.
PointCloud with_midpoints(const PointCloud& points, size_t most,
                          const std::function<bool(const glm::dvec3&)>& wanted = {});

}  // namespace ewa::scene
