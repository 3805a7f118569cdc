// SPDX-License-Identifier: Apache-2.0
// Planes through points, and the axes along which points spread.
#pragma once
#include <array>
#include <functional>
#include <glm/mat3x3.hpp>
#include <optional>
#include <vector>

namespace ewa::scene {

/// The axes of a symmetric matrix by its values, the smallest first.
struct Axes {
    std::array<double, 3> values{};
    std::array<glm::dvec3, 3> directions{};
};
Axes axes_of(const glm::dmat3& symmetric);

/// The mean squares of points about their mean, along and across their axes.
struct Spread {
    glm::dvec3 mean{0};
    Axes axes;
};
Spread spread_of(const std::vector<glm::dvec3>& points);

struct Plane {
    glm::dvec3 normal{0}, at{0};  // normal: unit length
};

/// The plane with the most points within `thickness`, among those that `accepts` takes, fitted to these points. accepts: may turn
/// the normal. Empty if it has fewer than 50 points or a tenth of all, or they are on a line. The same points give the same plane.
std::optional<Plane> largest_plane(const std::vector<glm::dvec3>& points, double thickness,
                                   const std::function<bool(Plane&)>& accepts);

}  // namespace ewa::scene
