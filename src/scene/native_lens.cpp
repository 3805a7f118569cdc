// SPDX-License-Identifier: Apache-2.0
#include "scene/native_lens.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>
#include <numbers>
#include <optional>

#include "scene/lens.h"
#include "shared/constants.h"

namespace ewa::scene {
namespace {

// A fisheye's point straight behind has no direction in the image.
constexpr double kMostAngle = std::numbers::pi - 0.02, kBeyondCorner = 1.1;
constexpr double kMaxTangent = 1000;
constexpr int kDirections = 16;

/// d(distance from the principal point)/d(angle) of a fisheye.
double fisheye_slope(const Distortion& d, double angle) {
    const double w = angle * angle;
    return 1 + w * (3 * d.k1 + w * (5 * d.k2 + w * (7 * d.k3 + w * 9 * d.k4)));
}

double fisheye_distance(const Distortion& d, double angle) {
    const double w = angle * angle;
    return angle * (1 + w * (d.k1 + w * (d.k2 + w * (d.k3 + w * d.k4))));
}

/// The distance of the farthest corner from the principal point, in focal lengths.
double corner_distance(const Camera& c) {
    const double x = std::max(c.cx, c.width - c.cx) / c.fx, y = std::max(c.cy, c.height - c.cy) / c.fy;
    return std::hypot(x, y);
}

double fisheye_limit(const Camera& camera) {
    constexpr int kSteps = 4096;
    const double corner = kBeyondCorner * corner_distance(camera);
    for (int i = 1; i <= kSteps; ++i) {
        const double angle = kMostAngle * i / kSteps;
        if (!(fisheye_slope(camera.distortion, angle) > 0)) return kMostAngle * (i - 1) / kSteps;
        if (fisheye_distance(camera.distortion, angle) > corner) return angle;
    }
    return kMostAngle;
}

double brown_limit(const Distortion& lens) {
    constexpr double kStep = 1.02;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < kDirections; ++i) {
        const double turn = 2 * std::numbers::pi * i / kDirections;
        const glm::dvec2 way(std::cos(turn), std::sin(turn));
        for (double r = 0.01; r < kMaxTangent && r * r < least; r *= kStep)
            if (!one_to_one(lens, r * way)) least = std::min(least, (r / kStep) * (r / kStep));
    }
    return least;
}

/// The farthest tangent of a side of the image, along the axis; `fallback` where no ray reaches it.
template <class At>
double farthest(const Distortion& lens, int axis, double sign, double fallback, const At& at) {
    double most = -std::numeric_limits<double>::infinity();
    for (int i = 0; i <= kDirections; ++i)
        if (const auto ray = undistort(lens, at(double(i) / kDirections)))
            most = std::max(most, sign * (*ray)[axis]);
    return sign * (std::isfinite(most) ? most : fallback);
}

}  // namespace

bool is_native(const Distortion& d) {
    if (d.skew != 0) return false;
    if (d.lens == Lens::fisheye)
        return d == Distortion{.k1 = d.k1, .k2 = d.k2, .k3 = d.k3, .k4 = d.k4, .lens = Lens::fisheye};
    return d.lens == Lens::brown || d.lens == Lens::equirectangular || d.lens == Lens::orthographic;
}

std::optional<glm::dvec2> pixel_of(const Camera& camera, double limit, const glm::dvec3& p) {
    const Distortion& d = camera.distortion;
    const double depth = ordered_by_distance(d.lens) ? glm::length(p) : p.z;
    if (!(depth > shared::NEAR_PLANE)) return std::nullopt;
    glm::dvec2 plane;
    if (d.lens == Lens::fisheye) {
        const double r = std::hypot(p.x, p.y), angle = std::atan2(r, p.z);
        if (!(angle <= limit)) return std::nullopt;
        plane = r > 0 ? fisheye_distance(d, angle) / r * glm::dvec2(p) : glm::dvec2(0);
    } else if (d.lens == Lens::equirectangular) {
        plane = {std::atan2(p.x, p.z), std::atan2(p.y, std::hypot(p.x, p.z))};
    } else if (d.lens == Lens::orthographic) {
        plane = p;
    } else {
        const glm::dvec2 tangent = glm::dvec2(p) / p.z;
        if (!(glm::dot(tangent, tangent) <= limit)) return std::nullopt;
        plane = d.none() ? tangent : distort(d, tangent);
    }
    return glm::dvec2(camera.fx * plane.x + camera.cx, camera.fy * plane.y + camera.cy);
}

namespace {

/// The angle from the axis whose image is at that distance from the principal point. The distance grows with the angle up to the
/// limit.
std::optional<double> angle_at(const Distortion& lens, double limit, double distance) {
    double low = 0, high = limit;
    if (fisheye_distance(lens, high) < distance) return std::nullopt;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (fisheye_distance(lens, middle) < distance ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

}  // namespace

std::optional<PixelRay> ray_of(const Camera& camera, double limit, double x, double y) {
    const glm::dvec2 plane((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy);
    switch (camera.distortion.lens) {
        case Lens::orthographic:
            return PixelRay{{plane, 0}, {0, 0, 1}};
        case Lens::equirectangular:
            return PixelRay{{},
                            {std::sin(plane.x) * std::cos(plane.y), std::sin(plane.y),
                             std::cos(plane.x) * std::cos(plane.y)}};
        case Lens::fisheye: {
            const double r = glm::length(plane);
            const auto angle = angle_at(camera.distortion, limit, r);
            if (!angle) return std::nullopt;
            const glm::dvec2 way = r > 0 ? plane / r : glm::dvec2(0);
            return PixelRay{{}, {std::sin(*angle) * way, std::cos(*angle)}};
        }
        default: {
            const std::optional<glm::dvec2> tangent =
                camera.distortion.none() ? plane : undistort(camera.distortion, plane);
            if (!tangent) return std::nullopt;
            return PixelRay{{}, glm::normalize(glm::dvec3(*tangent, 1))};
        }
    }
}

void set_equirectangular(Camera& camera) {
    camera.fx = camera.width / (2 * std::numbers::pi);
    camera.fy = camera.height / std::numbers::pi;
    camera.cx = 0.5 * camera.width;
    camera.cy = 0.5 * camera.height;
}

Camera through_lens(Camera camera, const Distortion& lens, double fisheye_degrees, const glm::dvec3& middle) {
    camera.distortion = lens;
    if (lens.lens == Lens::fisheye)
        camera.fx = camera.fy = std::min(camera.width, camera.height) / glm::radians(fisheye_degrees);
    if (lens.lens == Lens::equirectangular) set_equirectangular(camera);
    if (lens.lens == Lens::orthographic) {
        const double distance = std::max(1e-9, glm::length(camera.position() - middle));
        camera.fx /= distance;
        camera.fy /= distance;
    }
    return camera;
}

bool ordered_by_distance(Lens lens) {
    return lens == Lens::fisheye || lens == Lens::equirectangular;
}

bool shows_all_around(const Camera& camera) {
    const double around = 2 * std::numbers::pi * camera.fx;
    return camera.distortion.lens == Lens::equirectangular && std::abs(around - camera.width) < 1e-6 * around;
}

double lens_limit(const Camera& camera) {
    if (camera.distortion.lens == Lens::fisheye) return fisheye_limit(camera);
    if (camera.distortion.lens == Lens::brown && !camera.distortion.none())
        return brown_limit(camera.distortion);
    return std::numeric_limits<double>::infinity();
}

TangentBounds tangent_bounds(const Camera& camera) {
    const glm::dvec2 focal(camera.fx, camera.fy), center(camera.cx, camera.cy),
        size(camera.width, camera.height);
    const glm::dvec2 margin = shared::JACOBIAN_MARGIN * size / (2.0 * focal);
    TangentBounds bounds{-(center / focal + margin), (size - center) / focal + margin};
    const Distortion& lens = camera.distortion;
    if (lens.lens != Lens::brown || lens.none()) return bounds;
    const double fold = std::min(std::sqrt(brown_limit(lens)), kMaxTangent);
    const glm::dvec2 low = -center / focal, high = (size - center) / focal;
    const auto along = [&](int axis, double end) {
        return [&, axis, end](double share) {
            glm::dvec2 at = low + share * (high - low);
            at[axis] = end;
            return at;
        };
    };
    for (int axis = 0; axis < 2; ++axis) {
        bounds.low[axis] = farthest(lens, axis, -1, fold, along(axis, low[axis])) - margin[axis];
        bounds.high[axis] = farthest(lens, axis, 1, fold, along(axis, high[axis])) + margin[axis];
    }
    return bounds;
}

}  // namespace ewa::scene
