// SPDX-License-Identifier: Apache-2.0
#include "reference/tracing.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

namespace ewa::reference {

namespace {

/// The distance at which the ray enters the box. Empty if it misses.
std::optional<double> enter(const Ray& ray, const pathtracer::FloatBox& box, double reach) {
    double first = 0, last = reach;
    for (int axis = 0; axis < 3; ++axis) {
        const double low = double(box.low[axis]), high = double(box.high[axis]);
        if (low > high) return std::nullopt;
        const double o = ray.origin[axis], d = ray.direction[axis];
        if (d == 0) {
            if (o < low || o > high) return std::nullopt;
            continue;
        }
        const double a = (low - o) / d, b = (high - o) / d;
        first = std::max(first, std::min(a, b));
        last = std::min(last, std::max(a, b));
    }
    if (first > last) return std::nullopt;
    return first;
}

/// Tests the triangles [first, end). Each hit replaces `nearest` and shortens the ray.
void meet_range(Ray& ray, std::span<const pathtracer::DeviceTriangle> triangles, uint32_t first, uint32_t end,
                std::optional<Hit>& nearest) {
    for (uint32_t i = first; i < end; ++i)
        if (auto hit = meet(ray, triangles[i])) {
            nearest = Hit{i, hit->distance, hit->barycentric};
            ray.reach = hit->distance;
        }
}

}  // namespace

std::optional<Hit> meet(const Ray& ray, const pathtracer::DeviceTriangle& triangle) {
    const glm::dvec3 e1(triangle.edge1), e2(triangle.edge2);
    const glm::dvec3 p = glm::cross(ray.direction, e2), s = ray.origin - glm::dvec3(triangle.corner);
    const double determinant = glm::dot(e1, p);
    if (determinant == 0) return std::nullopt;
    const glm::dvec3 q = glm::cross(s, e1);
    const glm::dvec2 b(glm::dot(s, p) / determinant, glm::dot(ray.direction, q) / determinant);
    const double t = glm::dot(e2, q) / determinant;
    if (!(b.x >= 0 && b.y >= 0 && b.x + b.y <= 1 && t > 0 && t < ray.reach)) return std::nullopt;
    return Hit{0, t, b};
}

std::optional<Hit> nearest_of_all(const Ray& ray, std::span<const pathtracer::DeviceTriangle> triangles) {
    std::optional<Hit> nearest;
    Ray shorter = ray;
    meet_range(shorter, triangles, 0, uint32_t(triangles.size()), nearest);
    return nearest;
}

std::optional<Hit> trace(const Ray& ray, std::span<const pathtracer::Node> nodes,
                         std::span<const pathtracer::DeviceTriangle> triangles, size_t* deepest) {
    std::optional<Hit> nearest;
    Ray shorter = ray;
    std::vector<uint32_t> waiting = {0};
    while (!waiting.empty()) {
        const uint32_t reference = waiting.back();
        waiting.pop_back();
        if (reference & shared::LEAF_FLAG) {
            const uint32_t first = reference & shared::LEAF_FIRST_MASK;
            const uint32_t count = ((reference & ~shared::LEAF_FLAG) >> shared::LEAF_COUNT_SHIFT) + 1;
            meet_range(shorter, triangles, first, first + count, nearest);
            continue;
        }
        const pathtracer::Node& node = nodes[reference];
        const auto t0 = enter(ray, node.boxes[0], shorter.reach),
                   t1 = enter(ray, node.boxes[1], shorter.reach);
        const bool first = !t1 || (t0 && *t0 <= *t1);
        if (t0 && t1) {
            waiting.push_back(node.references[first ? 1 : 0]);
            if (deepest) *deepest = std::max(*deepest, waiting.size());
        }
        if (t0 || t1) waiting.push_back(node.references[first ? 0 : 1]);
    }
    return nearest;
}

}  // namespace ewa::reference
