// SPDX-License-Identifier: Apache-2.0
// The distance between two points on surfaces of the scene, which the user clicks. Independent of the window.
#pragma once
#include <spdlog/fmt/fmt.h>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

namespace ewa::viewer {

struct Measurement {
    std::vector<glm::dvec3> points;  // world; at most two

    /// Adds a point. A third point removes the first two, and begins the next measurement.
    void add(const glm::dvec3& point) {
        if (points.size() == 2) points.clear();
        points.push_back(point);
    }
    bool complete() const { return points.size() == 2; }
    double distance() const { return glm::length(points[1] - points[0]); }
    std::string label() const { return fmt::format("{:.4g}", distance()); }
    /// The distance, and the points in the form that --scale-to of `ewa convert` takes. Requires complete().
    std::string text() const {
        const glm::dvec3 &a = points[0], &b = points[1];
        return fmt::format("distance {}; points {:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}", label(), a.x, a.y,
                           a.z, b.x, b.y, b.z);
    }
};

}  // namespace ewa::viewer
