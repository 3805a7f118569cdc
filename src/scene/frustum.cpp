// SPDX-License-Identifier: Apache-2.0
#include "scene/frustum.h"

#include <cmath>
#include <glm/matrix.hpp>

#include "scene/native_lens.h"
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

glm::dvec3 world_point(const Camera& camera, double x, double y, double depth) {
    glm::dvec3 view((x - camera.cx) / camera.fx * depth, (y - camera.cy) / camera.fy * depth, depth);
    if (!camera.distortion.none()) {
        const auto ray = scene::ray_of(camera, scene::lens_limit(camera), x, y);
        if (!ray) return camera.position();
        const bool along = scene::ordered_by_distance(camera.distortion.lens);
        view = ray->origin + ray->direction * (along ? depth : depth / ray->direction.z);
    }
    return glm::transpose(camera.rotation) * (view - camera.translation);
}

std::array<Segment, 10> frustum_segments(const Camera& camera, double depth) {
    const double w = camera.width, h = camera.height;
    // The corners of a fisheye's image show nothing, and those of 360° its poles.
    const double shown = scene::ordered_by_distance(camera.distortion.lens) ? 0.5 : 1;
    const auto at_depth = [&](double x, double y, double z) {
        return world_point(camera, w / 2 + shown * (x - w / 2), h / 2 + shown * (y - h / 2), z);
    };
    const auto world = [&](double x, double y) { return at_depth(x, y, depth); };
    const std::array corners{world(0, 0), world(w, 0), world(w, h), world(0, h)};
    const glm::dvec3 roof = world(w / 2, -h / 5);
    const std::array begins{at_depth(0, 0, 0), at_depth(w, 0, 0), at_depth(w, h, 0), at_depth(0, h, 0)};
    std::array<Segment, 10> segments;
    for (size_t i = 0; i < 4; ++i) {
        segments[i] = {begins[i], corners[i]};
        segments[4 + i] = {corners[i], corners[(i + 1) % 4]};
    }
    segments[8] = {world(w / 4, 0), roof};
    segments[9] = {world(3 * w / 4, 0), roof};
    return segments;
}

std::optional<std::array<glm::dvec2, 2>> projected(const Segment& segment, const Camera& camera) {
    glm::dvec3 from = view_of(segment.from, camera), to = view_of(segment.to, camera);
    constexpr double kNear = shared::NEAR_PLANE;
    if (scene::ordered_by_distance(camera.distortion.lens)) {
        const double limit = scene::lens_limit(camera);
        const auto a = scene::pixel_of(camera, limit, from), b = scene::pixel_of(camera, limit, to);
        if (!a || !b) return std::nullopt;
        if (scene::shows_all_around(camera) && std::abs(a->x - b->x) > 0.75 * camera.width)
            return std::nullopt;
        return std::array{*a, *b};
    }
    if (!(from.z > kNear) && !(to.z > kNear)) return std::nullopt;
    if (from.z < kNear) from += (to - from) * ((kNear - from.z) / (to.z - from.z));
    if (to.z < kNear) to += (from - to) * ((kNear - to.z) / (from.z - to.z));
    if (camera.distortion.none()) return std::array{pixel_of(from, camera), pixel_of(to, camera)};
    const double limit = scene::lens_limit(camera);
    const glm::dvec3 ahead(0, 0, 1e-9);  // an end on the near plane itself is not shown
    const auto a = scene::pixel_of(camera, limit, from + ahead),
               b = scene::pixel_of(camera, limit, to + ahead);
    if (!a || !b) return std::nullopt;
    return std::array{*a, *b};
}

std::optional<glm::dvec2> projected(const glm::dvec3& point, const Camera& camera) {
    const glm::dvec3 view = view_of(point, camera);
    if (!camera.distortion.none()) return scene::pixel_of(camera, scene::lens_limit(camera), view);
    if (!(view.z > shared::NEAR_PLANE)) return std::nullopt;
    return pixel_of(view, camera);
}

}  // namespace ewa
