// SPDX-License-Identifier: Apache-2.0
#include "edit/ground.h"

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/trigonometric.hpp>

#include "edit/edited_splats.h"
#include "scene/statistics.h"

namespace ewa::edit {

glm::dmat4 level_plane(const scene::Plane& plane) {
    const glm::dvec3 up(0, -1, 0), axis = glm::cross(plane.normal, up);
    const double sine = glm::length(axis), angle = std::atan2(sine, glm::dot(plane.normal, up));
    const glm::dmat4 turn =
        glm::rotate(glm::dmat4(1.0), angle, sine > 1e-12 ? axis / sine : glm::dvec3(1, 0, 0));
    return glm::translate(glm::dmat4(1.0), glm::dvec3(plane.at.x, 0, plane.at.z)) * turn *
           glm::translate(glm::dmat4(1.0), -plane.at);
}

std::optional<glm::dmat4> level_ground(const Gaussians& splats, const std::vector<uint8_t>& states,
                                       const glm::dvec3& up) {
    constexpr size_t kMostPoints = 5000;
    constexpr float kLeastLogit = -2.2f;  // an opacity of 0.1
    constexpr double kThickness = 0.01;   // of the usual distance from the middle
    constexpr double kMostBelow = 0.1, kSteepest = 40;
    std::vector<glm::dvec3> points;
    for (size_t i = 0; i < splats.size(); ++i) {
        const glm::dvec3 at = splats.world_mean(i);
        if (i < states.size() && (states[i] & (kDeleted | kHidden)) != 0) continue;
        if (splats.opacity_logits[i] >= kLeastLogit && std::isfinite(at.x + at.y + at.z))
            points.push_back(at);
    }
    const size_t step = points.size() / kMostPoints + 1;
    for (size_t i = 0; i * step < points.size(); ++i) points[i] = points[i * step];
    points.resize((points.size() + step - 1) / step);
    glm::dvec3 middle(0);
    std::vector<double> values(points.size());
    for (int axis = 0; axis < 3; ++axis) {
        for (size_t i = 0; i < points.size(); ++i) values[i] = points[i][axis];
        middle[axis] = scene::quantile(values, 0.5);
    }
    for (size_t i = 0; i < points.size(); ++i) values[i] = glm::length(points[i] - middle);
    const double thickness = kThickness * scene::quantile(values, 0.5);
    const auto plane = scene::largest_plane(points, thickness, [&](scene::Plane& found) {
        if (glm::dot(found.normal, up) < 0) found.normal = -found.normal;
        if (glm::dot(found.normal, up) < std::cos(glm::radians(kSteepest))) return false;
        size_t below = 0;
        for (const glm::dvec3& point : points)
            below += glm::dot(point - found.at, found.normal) < -2 * thickness;
        return double(below) <= kMostBelow * double(points.size());
    });
    return plane ? std::optional(level_plane(*plane)) : std::nullopt;
}

}  // namespace ewa::edit
