// SPDX-License-Identifier: Apache-2.0
// A denser point cloud to start a training from.
#pragma once
#include <cstddef>

#include "ewa/dataset.h"

namespace ewa::scene {

/// `points`, followed by the middles between neighbours: each point and the two points nearest to it. A middle has the mean
/// of both colours. With more than `most` points in all, the middles of the longest distances are taken. `points` must be
/// finite, and have a colour each.
PointCloud with_midpoints(const PointCloud& points, size_t most);

}  // namespace ewa::scene
