// SPDX-License-Identifier: Apache-2.0
#include "scene/picture_views.h"

#include <cmath>
#include <numbers>

namespace ewa::scene {

bool has_movable_eye(const Camera& camera) {
    return camera.distortion.none() && !camera.readout;
}

Camera moved_eye(Camera camera, const glm::dvec2& offset, double focus) {
    camera.translation -= glm::dvec3(offset, 0);
    camera.cx += camera.fx * offset.x / focus;
    camera.cy += camera.fy * offset.y / focus;
    return camera;
}

glm::dvec2 disc_point(int i, int count) {
    const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
    return std::sqrt((i + 0.5) / count) * glm::dvec2(std::cos(golden * i), std::sin(golden * i));
}

double even_share(int i) {
    double share = 0, part = 0.5;
    for (; i > 0; i >>= 1, part /= 2) share += (i & 1) * part;
    return share;
}

}  // namespace ewa::scene
