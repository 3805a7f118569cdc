// SPDX-License-Identifier: Apache-2.0
// Depth images of pinhole cameras, and the pixels at which they show points.
#pragma once
#include <cmath>
#include <functional>
#include <glm/vec2.hpp>

#include "ewa/camera.h"
#include "ewa/image.h"

namespace ewa::mesh {

/// The depth of view i: one channel, view z, 0 where no surface is. It is asked for several times.
using DepthOfView = std::function<const Image&(size_t)>;

inline double focal(const Camera& camera) {
    return std::sqrt(camera.fx * camera.fy);
}

/// The pixel position (px) of a point in view coordinates, whose z is above zero.
template <class Point>
auto pixel_of(const Camera& camera, const Point& p) {
    using Value = decltype(p.x);
    return glm::vec<2, Value>(Value(camera.fx) * p.x / p.z + Value(camera.cx),
                              Value(camera.fy) * p.y / p.z + Value(camera.cy));
}

}  // namespace ewa::mesh
