// SPDX-License-Identifier: Apache-2.0
#include "scene/planes.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "core/random.h"
#include "scene/splat_shape.h"

namespace ewa::scene {

Axes axes_of(const glm::dmat3& symmetric) {
    const Decomposition d = decompose(symmetric);
    std::array<int, 3> order{0, 1, 2};
    std::ranges::sort(order, {}, [&](int k) { return d.s[k]; });
    Axes axes;
    for (size_t i = 0; i < 3; ++i) {
        axes.values[i] = d.s[order[i]];
        axes.directions[i] = d.v[order[i]];
    }
    return axes;
}

Spread spread_of(const std::vector<glm::dvec3>& points) {
    Spread spread;
    for (const glm::dvec3& point : points) spread.mean += point / double(points.size());
    glm::dmat3 products(0);
    for (const glm::dvec3& point : points)
        products += glm::outerProduct(point - spread.mean, point - spread.mean) / double(points.size());
    spread.axes = axes_of(products);
    return spread;
}

std::optional<Plane> largest_plane(const std::vector<glm::dvec3>& points, double thickness,
                                   const std::function<bool(Plane&)>& accepts) {
    constexpr size_t kLeast = 50;
    constexpr uint32_t kTries = 3000;
    constexpr double kShare = 0.1;  // of the points
    constexpr int kRounds = 5;
    constexpr double kWide = 5;  // thicknesses that the plane is wide
    const auto on = [&](const Plane& plane) {
        std::vector<glm::dvec3> found;
        for (const glm::dvec3& point : points)
            if (std::abs(glm::dot(point - plane.at, plane.normal)) < thickness) found.push_back(point);
        return found;
    };
    if (points.size() < kLeast || !(thickness > 0)) return {};
    Plane best;
    size_t most = 0;
    for (uint32_t i = 0; i < kTries; ++i) {
        const auto u = core::uniform4({i, 1, 0, 0});
        std::array<glm::dvec3, 3> corners;
        for (size_t k = 0; k < 3; ++k) corners[k] = points[size_t(u[k] * double(points.size()))];
        const glm::dvec3 normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
        if (!(glm::length(normal) > 0)) continue;
        Plane plane{glm::normalize(normal), corners[0]};
        if (!accepts(plane)) continue;
        if (const size_t count = on(plane).size(); count > most) {
            most = count;
            best = plane;
        }
    }
    if (double(most) < std::max(kShare * double(points.size()), double(kLeast))) return {};
    for (int round = 0; round < kRounds; ++round) {
        const Spread spread = spread_of(on(best));
        if (std::sqrt(spread.axes.values[1]) < kWide * thickness) return {};
        best = {spread.axes.directions[0], spread.mean};
        if (!accepts(best) || on(best).size() < kLeast) return {};
    }
    return best;
}

}  // namespace ewa::scene
