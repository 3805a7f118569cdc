// SPDX-License-Identifier: Apache-2.0
#include "scene/frustum.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "shared/constants.h"

namespace ewa {
namespace {

glm::dvec3 view_of(const glm::dvec3& point, const Camera& camera) {
    return camera.rotation * point + camera.translation;
}

glm::dvec2 pixel_of(const glm::dvec3& view, const Camera& camera) {
    return {camera.fx * view.x / view.z + camera.cx, camera.fy * view.y / view.z + camera.cy};
}

}  // namespace

std::array<Segment, 10> frustum_segments(const Camera& camera, double depth) {
    const glm::dvec3 eye = camera.position();
    const auto world = [&](double x, double y) {
        const glm::dvec3 view((x - camera.cx) / camera.fx * depth, (y - camera.cy) / camera.fy * depth,
                              depth);
        return eye + glm::transpose(camera.rotation) * view;
    };
    const double w = camera.width, h = camera.height;
    const std::array corners{world(0, 0), world(w, 0), world(w, h), world(0, h)};
    const glm::dvec3 roof = world(w / 2, -h / 5);
    std::array<Segment, 10> segments;
    for (size_t i = 0; i < 4; ++i) {
        segments[i] = {eye, corners[i]};
        segments[4 + i] = {corners[i], corners[(i + 1) % 4]};
    }
    segments[8] = {world(w / 4, 0), roof};
    segments[9] = {world(3 * w / 4, 0), roof};
    return segments;
}

std::optional<std::array<glm::dvec2, 2>> projected(const Segment& segment, const Camera& camera) {
    glm::dvec3 from = view_of(segment.from, camera), to = view_of(segment.to, camera);
    constexpr double kNear = shared::NEAR_PLANE;
    if (!(from.z > kNear) && !(to.z > kNear)) return std::nullopt;
    if (from.z < kNear) from += (to - from) * ((kNear - from.z) / (to.z - from.z));
    if (to.z < kNear) to += (from - to) * ((kNear - to.z) / (from.z - to.z));
    return std::array{pixel_of(from, camera), pixel_of(to, camera)};
}

std::optional<glm::dvec2> projected(const glm::dvec3& point, const Camera& camera) {
    const glm::dvec3 view = view_of(point, camera);
    if (!(view.z > shared::NEAR_PLANE)) return std::nullopt;
    return pixel_of(view, camera);
}

}  // namespace ewa
