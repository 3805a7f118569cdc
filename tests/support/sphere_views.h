// SPDX-License-Identifier: Apache-2.0
// Views of spheres, whose depth is known in closed form.
#pragma once
#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "ewa/image.h"
#include "scene/framing.h"

namespace ewa::test {

/// Around a point at a distance of 2, from all sides on Fibonacci's spiral.
inline std::vector<Camera> cameras_around(const glm::dvec3& middle, int count) {
    std::vector<Camera> cameras;
    for (int i = 0; i < count; ++i) {
        const double z = 1 - (2 * i + 1.0) / count, turn = i * 2.39996;
        const glm::dvec3 to(std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z);
        cameras.push_back(scene::look_at(middle + 2.0 * to, middle, {0, 0, 1}, 160, 120));
    }
    return cameras;
}

/// View z of the sphere: its front from outside, or its inner side from within. 0 beside it.
inline Image sphere_depth(const Camera& camera, const glm::dvec3& middle, double radius) {
    Image depth(camera.width, camera.height, 1);
    const glm::dvec3 seen = camera.rotation * middle + camera.translation;
    const bool inside = glm::length(seen) < radius;
    for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
            const glm::dvec3 ray((x + 0.5 - camera.cx) / camera.fx, (y + 0.5 - camera.cy) / camera.fy, 1);
            const double a = glm::dot(ray, ray), b = glm::dot(ray, seen);
            const double root = b * b - a * (glm::dot(seen, seen) - radius * radius);
            if (root > 0) *depth.at(x, y) = float((b + (inside ? 1 : -1) * std::sqrt(root)) / a);
        }
    return depth;
}

}  // namespace ewa::test
