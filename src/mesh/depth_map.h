// SPDX-License-Identifier: Apache-2.0
// Where a pinhole shows points, and the depth that it has there.
#pragma once
#include <algorithm>
#include <cmath>
#include <glm/vec2.hpp>

#include "ewa/camera.h"
#include "ewa/image.h"

namespace ewa::mesh {

inline double focal(const Camera& camera) {
    return std::sqrt(camera.fx * camera.fy);
}

/// px of a point in view coordinates, whose z is above zero.
template <class Point>
auto pixel_of(const Camera& camera, const Point& p) {
    using Value = decltype(p.x);
    return glm::vec<2, Value>(Value(camera.fx) * p.x / p.z + Value(camera.cx),
                              Value(camera.fy) * p.y / p.z + Value(camera.cy));
}

/// The depth there, 0 outside and where no surface is. Bilinear where the four pixels around differ by at most `step`; at an
/// edge of something, that of the nearest pixel.
inline float depth_at(const Image& depth, const glm::vec2& at, float step) {
    if (!(at.x >= 0 && at.y >= 0 && at.x < float(depth.width) && at.y < float(depth.height))) return 0;
    const float nearest = *depth.at(int(at.x), int(at.y));
    const float fx = std::floor(at.x - 0.5f), fy = std::floor(at.y - 0.5f);
    const int x = int(fx), y = int(fy);
    if (x < 0 || y < 0 || x + 1 >= depth.width || y + 1 >= depth.height) return nearest;
    const float* a = depth.at(x, y);
    const float* b = depth.at(x, y + 1);
    const float low = std::min({a[0], a[1], b[0], b[1]}), high = std::max({a[0], a[1], b[0], b[1]});
    if (!(low > 0) || high - low > step) return nearest;
    const float u = at.x - 0.5f - fx, v = at.y - 0.5f - fy;
    return (1 - v) * ((1 - u) * a[0] + u * a[1]) + v * ((1 - u) * b[0] + u * b[1]);
}

}  // namespace ewa::mesh
