// SPDX-License-Identifier: Apache-2.0
#include "mesh/distance.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <numbers>
#include <tuple>

#include "core/parallel.h"
#include "core/random.h"
#include "ewa/error.h"

namespace ewa::mesh {
namespace {

using Triple = std::array<glm::dvec3, 3>;

glm::dvec3 doubled_area(const Triple& t) {
    return glm::cross(t[1] - t[0], t[2] - t[0]);
}

/// Ericson, Real-Time Collision Detection (2005), 5.1.5.
glm::dvec3 nearest_in(const Triple& t, const glm::dvec3& p) {
    const auto& [a, b, c] = t;
    const glm::dvec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return a;
    const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return b;
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
    const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return c;
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
    return a + (vb * ab + vc * ac) / (va + vb + vc);
}

double squared_distance(const pathtracer::FloatBox& box, const glm::dvec3& p) {
    const glm::dvec3 low(box.low), high(box.high);
    const glm::dvec3 d = p - glm::clamp(p, low, high);
    return glm::dot(d, d);
}

/// A box in float32 that holds the triangle.
pathtracer::FloatBox box_of(const Triple& t) {
    pathtracer::FloatBox box;
    for (const glm::dvec3& p : t)
        for (int k = 0; k < 3; ++k) {
            box.low[k] = std::min(box.low[k], std::nextafter(float(p[k]), -3e38f));
            box.high[k] = std::max(box.high[k], std::nextafter(float(p[k]), 3e38f));
        }
    return box;
}

}  // namespace

Surface::Surface(const scene::MeshScene& scene) {
    double area = 0;
    std::vector<pathtracer::FloatBox> boxes;
    for (const scene::Triangle& t : scene.triangles) {
        const double size = glm::length(doubled_area(t.corners)) / 2;
        if (!(size > 0)) continue;
        triangles_.push_back(t.corners);
        areas_.push_back(area += size);
        boxes.push_back(box_of(t.corners));
    }
    if (triangles_.empty()) throw InputError("no triangle of the mesh has an area");
    hierarchy_ = pathtracer::build_hierarchy(boxes);
}

Surface::Surface(const std::vector<glm::dvec3>& points) : scan_(true) {
    if (points.empty()) throw InputError("the scan has no points");
    std::vector<pathtracer::FloatBox> boxes;
    for (const glm::dvec3& p : points) {
        triangles_.push_back({p, p, p});
        boxes.push_back(box_of(triangles_.back()));
    }
    hierarchy_ = pathtracer::build_hierarchy(boxes);
}

Surface::Nearest Surface::nearest(const glm::dvec3& point) const {
    double best = std::numeric_limits<double>::infinity();
    size_t found = 0;
    const auto meet_leaf = [&](uint32_t reference) {
        const uint32_t first = reference & shared::LEAF_FIRST_MASK;
        const uint32_t count = ((reference & ~shared::LEAF_FLAG) >> shared::LEAF_COUNT_SHIFT) + 1;
        for (uint32_t i = first; i < first + count; ++i) {
            const size_t triangle = hierarchy_.order[i];
            const glm::dvec3 d = point - nearest_in(triangles_[triangle], point);
            const double squared = glm::dot(d, d);
            if (squared < best || (squared == best && triangle < found)) {
                best = squared;
                found = triangle;
            }
        }
    };
    struct Open {
        uint32_t reference;
        double squared;
    };
    std::vector<Open> open = {{0, 0}};
    while (!open.empty()) {
        const Open next = open.back();
        open.pop_back();
        if (next.squared > best) continue;
        if (next.reference & shared::LEAF_FLAG) {
            meet_leaf(next.reference);
            continue;
        }
        const pathtracer::Node& node = hierarchy_.nodes[next.reference];
        std::array<Open, 2> children{};
        for (size_t c = 0; c < 2; ++c) {
            const bool missing = node.boxes[c].low.x > node.boxes[c].high.x;
            children[c] = {node.references[c], missing ? std::numeric_limits<double>::infinity()
                                                       : squared_distance(node.boxes[c], point)};
        }
        // The nearer child is met first.
        if (children[0].squared < children[1].squared) std::swap(children[0], children[1]);
        for (const Open& child : children)
            if (child.squared <= best && std::isfinite(child.squared)) open.push_back(child);
    }
    return {std::sqrt(best), found, scan_ ? glm::dvec3(0) : glm::normalize(doubled_area(triangles_[found]))};
}

Surface::Point Surface::sample(size_t i, size_t count, uint32_t seed) const {
    if (scan_)
        return {triangles_[count == size() ? i : size_t(double(i) / double(count) * double(size()))][0], {}};
    const auto u = core::uniform4({uint32_t(i), uint32_t(uint64_t(i) >> 32), seed, 0});
    const double at = (double(i) + u[0]) / double(count) * area();
    const auto found = std::ranges::lower_bound(areas_, at);
    const Triple& t = triangles_[std::min(size_t(found - areas_.begin()), triangles_.size() - 1)];
    const double root = std::sqrt(u[1]), b = root * (1 - u[2]), c = root * u[2];
    return {(1 - root) * t[0] + b * t[1] + c * t[2], glm::normalize(doubled_area(t))};
}

double Surface::diagonal() const {
    glm::dvec3 low(1e300), high(-1e300);
    for (const Triple& t : triangles_)
        for (const glm::dvec3& p : t) {
            low = glm::min(low, p);
            high = glm::max(high, p);
        }
    return glm::length(high - low);
}

namespace {

/// What points on one surface have to the other.
struct OneWay {
    double mean = 0, within = 0, angle = 0;
};

OneWay from_to(const Surface& from, const Surface& to, size_t points, uint32_t seed,
               const SurfaceComparison& comparison) {
    struct Row {
        double distance, cosine;
    };
    std::vector<Row> rows(points);
    constexpr size_t kTogether = 1024;
    core::on_all_cores((points + kTogether - 1) / kTogether, [&](size_t group) {
        for (size_t i = group * kTogether; i < std::min(points, (group + 1) * kTogether); ++i) {
            const Surface::Point point = from.sample(i, points, seed);
            const Surface::Nearest found = to.nearest(point.position);
            rows[i] = {found.distance, std::abs(glm::dot(point.normal, found.normal))};
        }
    });
    OneWay out;
    for (const Row& row : rows) {
        out.within += row.distance <= comparison.threshold ? 1 : 0;
        out.angle += std::acos(std::min(1.0, row.cosine));
        out.mean += row.distance;
    }
    out.mean /= double(points);
    out.within /= double(points);
    out.angle *= 180 / std::numbers::pi / double(points);
    return out;
}

}  // namespace

SurfaceDifference difference(const Surface& a, const Surface& b, const SurfaceComparison& comparison) {
    const OneWay of_a = from_to(a, b, comparison.points_a, 1, comparison);
    const OneWay of_b = from_to(b, a, comparison.points_b, 2, comparison);
    return {.accuracy = of_a.mean,
            .completeness = of_b.mean,
            .threshold = comparison.threshold,
            .precision = of_a.within,
            .recall = of_b.within,
            .normal_error = a.scan() || b.scan() ? std::nan("") : of_a.angle};
}

scene::TriangleMesh joined(const scene::MeshScene& scene) {
    scene::TriangleMesh mesh;
    std::map<std::tuple<double, double, double>, uint32_t> places;
    for (const scene::Triangle& t : scene.triangles) {
        auto& corners = mesh.triangles.emplace_back();
        for (size_t k = 0; k < 3; ++k) {
            const glm::dvec3& p = t.corners[k];
            const auto [place, added] = places.try_emplace({p.x, p.y, p.z}, uint32_t(places.size()));
            if (added) mesh.positions.emplace_back(p);
            corners[k] = place->second;
        }
    }
    return mesh;
}

}  // namespace ewa::mesh
