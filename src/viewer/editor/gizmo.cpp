// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/gizmo.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <utility>

#include "edit/ground.h"
#include "scene/native_lens.h"

namespace ewa::viewer {
namespace {

constexpr double kParallel = 1e-3;  // sine or cosine below which directions count as parallel

glm::dvec3 view_direction(const Camera& camera) {
    return {camera.rotation[0][2], camera.rotation[1][2], camera.rotation[2][2]};
}

/// The part of a row that a capsule covers: the points within `radius` of a segment. The first number is the larger one if it
/// covers nothing.
std::pair<double, double> capsule_span(const glm::dvec2& a, const glm::dvec2& b, double radius, double y) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    const auto cover = [&](double from, double to) {
        low = std::min(low, from);
        high = std::max(high, to);
    };
    for (const glm::dvec2& end : {a, b}) {
        const double rest = radius * radius - (y - end.y) * (y - end.y);
        if (rest >= 0) cover(end.x - std::sqrt(rest), end.x + std::sqrt(rest));
    }
    const glm::dvec2 way = b - a;
    const double length = glm::length(way);
    if (!(length > 0) || way.y == 0) return {low, high};
    for (const double side : {-radius, radius}) {
        const glm::dvec2 from = a + glm::dvec2(-way.y, way.x) * (side / length);
        const double share = (y - from.y) / way.y;
        if (share >= 0 && share <= 1) cover(from.x + share * way.x, from.x + share * way.x);
    }
    return {low, high};
}

}  // namespace

std::optional<ToolRay> ray_through(const Camera& camera, const glm::dvec2& pixel) {
    const auto ray = scene::ray_of(camera, scene::lens_limit(camera), pixel.x, pixel.y);
    if (!ray) return std::nullopt;
    const glm::dmat3 world = glm::transpose(camera.rotation);
    return ToolRay{world * (ray->origin - camera.translation), glm::normalize(world * ray->direction)};
}

glm::dvec3 towards_viewer(const Camera& camera, const glm::dvec3& point) {
    const glm::dvec3 way = camera.position() - point;
    const double length = glm::length(way);
    if (camera.distortion.lens == Lens::orthographic || !(length > 0)) return -view_direction(camera);
    return way / length;
}

double world_per_pixel(const Camera& camera, const glm::dvec3& point) {
    if (camera.distortion.lens == Lens::orthographic) return 1 / camera.fx;
    const double depth = scene::ordered_by_distance(camera.distortion.lens)
                             ? glm::length(point - camera.position())
                             : glm::dot(point - camera.position(), view_direction(camera));
    return std::max(depth, 1e-9) / camera.fx;
}

std::optional<double> along_axis(const ToolRay& ray, const glm::dvec3& origin, const glm::dvec3& axis) {
    const double cosine = glm::dot(ray.direction, axis), sine2 = 1 - cosine * cosine;
    if (!(sine2 > kParallel * kParallel)) return std::nullopt;
    const glm::dvec3 between = ray.origin - origin;
    return (glm::dot(between, axis) - cosine * glm::dot(between, ray.direction)) / sine2;
}

std::optional<glm::dvec3> on_plane(const ToolRay& ray, const glm::dvec3& point, const glm::dvec3& normal) {
    const double cosine = glm::dot(ray.direction, normal);
    if (!(std::abs(cosine) > kParallel)) return std::nullopt;
    const double distance = glm::dot(point - ray.origin, normal) / cosine;
    if (!(distance >= 0)) return std::nullopt;
    return ray.origin + ray.direction * distance;
}

double angle_about(const glm::dvec3& axis, const glm::dvec3& from, const glm::dvec3& to) {
    const glm::dvec3 a = from - axis * glm::dot(axis, from), b = to - axis * glm::dot(axis, to);
    return std::atan2(glm::dot(axis, glm::cross(a, b)), glm::dot(a, b));
}

glm::dmat3 turn_about(const glm::dvec3& axis, double angle) {
    const glm::dmat3 cross(0, axis.z, -axis.y, -axis.z, 0, axis.x, axis.y, -axis.x, 0);
    return glm::dmat3(1.0) + std::sin(angle) * cross + (1 - std::cos(angle)) * cross * cross;
}

double nice_unit(double size) {
    const double power = std::pow(10, std::floor(std::log10(size)));
    const double share = size / power * (1 + 1e-12);
    return power * (share >= 5 ? 5 : share >= 2 ? 2 : 1);
}

double snapped(double value, double step) {
    return step > 0 ? std::round(value / step) * step : value;
}

glm::dmat4 about(const glm::dvec3& center, const glm::dmat3& linear) {
    glm::dmat4 matrix(linear);
    matrix[3] = glm::dvec4(center - linear * center, 1);
    return matrix;
}

std::string matrix_text(const glm::dmat4& matrix) {
    std::string text;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column)
            text += fmt::format("{}{:.9g}", text.empty() ? "" : ",", matrix[column][row]);
    return text;
}

std::string point_text(const glm::dvec3& point) {
    return fmt::format("{:.9g},{:.9g},{:.9g}", point.x, point.y, point.z);
}

std::optional<glm::dmat4> level_matrix(const std::array<glm::dvec3, 3>& points, const glm::dvec3& viewer) {
    const glm::dvec3 a = points[1] - points[0], b = points[2] - points[0], c = b - a;
    glm::dvec3 normal = glm::cross(a, b);
    const double area = glm::length(normal);
    const double longest = std::max({glm::dot(a, a), glm::dot(b, b), glm::dot(c, c)});
    if (!(area > 1e-3 * longest)) return std::nullopt;
    normal *= (glm::dot(normal, viewer) < 0 ? -1 : 1) / area;
    return edit::level_plane({normal, (points[0] + points[1] + points[2]) / 3.0});
}

Camera carried(const Camera& camera, const glm::dmat4& matrix) {
    const glm::dmat3 linear(matrix);
    const double scale = std::cbrt(glm::determinant(linear));
    Camera moved = camera;
    moved.rotation = camera.rotation * glm::transpose(linear / scale);
    moved.translation = scale * camera.translation - moved.rotation * glm::dvec3(matrix[3]);
    return moved;
}

double distance_to_segment(const glm::dvec2& point, const glm::dvec2& from, const glm::dvec2& to) {
    const glm::dvec2 way = to - from;
    const double length2 = glm::dot(way, way);
    const double share = length2 > 0 ? std::clamp(glm::dot(point - from, way) / length2, 0.0, 1.0) : 0;
    return glm::length(point - from - way * share);
}

double distance_to_line(const glm::dvec2& point, const std::vector<glm::dvec2>& line) {
    if (line.size() == 1) return glm::length(point - line[0]);
    double least = std::numeric_limits<double>::infinity();
    for (size_t i = 1; i < line.size(); ++i)
        least = std::min(least, distance_to_segment(point, line[i - 1], line[i]));
    return least;
}

std::vector<glm::dvec2> simplified(const std::vector<glm::dvec2>& line, double tolerance) {
    if (line.size() < 3) return line;
    std::vector<bool> kept(line.size(), false);
    kept.front() = kept.back() = true;
    std::vector<std::pair<size_t, size_t>> parts{{0, line.size() - 1}};
    while (!parts.empty()) {
        const auto [first, last] = parts.back();
        parts.pop_back();
        size_t farthest = first;
        double most = tolerance;
        for (size_t i = first + 1; i < last; ++i) {
            const double distance = distance_to_segment(line[i], line[first], line[last]);
            if (!(distance > most)) continue;
            most = distance;
            farthest = i;
        }
        if (farthest == first) continue;
        kept[farthest] = true;
        parts.push_back({first, farthest});
        parts.push_back({farthest, last});
    }
    std::vector<glm::dvec2> fewer;
    for (size_t i = 0; i < line.size(); ++i)
        if (kept[i]) fewer.push_back(line[i]);
    return fewer;
}

std::vector<StrokeSpan> stroke_spans(const std::vector<glm::dvec2>& line, double radius, double step) {
    std::vector<StrokeSpan> spans;
    if (line.empty()) return spans;
    double top = line[0].y, bottom = line[0].y;
    for (const glm::dvec2& point : line) {
        top = std::min(top, point.y);
        bottom = std::max(bottom, point.y);
    }
    std::vector<std::pair<double, double>> parts;
    for (double y = top - radius + step / 2; y < bottom + radius; y += step) {
        parts.clear();
        for (size_t i = 0; i < line.size(); ++i)
            if (const auto part = capsule_span(line[i > 0 ? i - 1 : 0], line[i], radius, y);
                part.first < part.second)
                parts.push_back(part);
        std::sort(parts.begin(), parts.end());
        const size_t row = spans.size();
        for (const auto& [low, high] : parts) {
            if (spans.size() > row && low <= spans.back().high)
                spans.back().high = std::max(spans.back().high, high);
            else
                spans.push_back({y, low, high});
        }
    }
    return spans;
}

}  // namespace ewa::viewer
