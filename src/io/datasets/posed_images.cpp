// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/posed_images.h"

#include <cmath>

namespace ewa::io {

void add_point(PointCloud& points, DroppedPoints& dropped, const glm::dvec3& position,
               const std::array<uint8_t, 3>& color, const std::function<std::string()>& where) {
    for (int axis = 0; axis < 3; ++axis)
        if (!std::isfinite(static_cast<float>(position[axis]))) {
            if (dropped.count++ == 0) dropped.first = where();
            return;
        }
    points.positions.push_back(position);
    points.colors.push_back(color);
}

}  // namespace ewa::io
