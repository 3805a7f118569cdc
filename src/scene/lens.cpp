// SPDX-License-Identifier: Apache-2.0
#include "scene/lens.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>
#include <limits>
#include <numbers>
#include <optional>

#include "ewa/error.h"

namespace ewa::scene {

namespace {

// Rays beyond this angle from the axis, with a tangent of 1000, are not usefully in front of a pinhole
// camera.
constexpr double kMaxAngle = std::numbers::pi / 2 - 1e-3;

bool in_angles(const Distortion& d) {
    return d.lens == Lens::fisheye || d.lens == Lens::fisheye624;
}

/// c1 x + c2 x^2 + ... by Horner's rule.
template <class... Coefficients>
double polynomial(double x, Coefficients... coefficients) {
    double result = 0;
    const double list[] = {coefficients...};
    for (size_t i = std::size(list); i-- > 0;) result = x * (list[i] + result);
    return result;
}

glm::dvec2 tangential(const Distortion& d, glm::dvec2 q) {
    const double r2 = glm::dot(q, q), xy = q.x * q.y;
    return {2 * d.p1 * xy + d.p2 * (r2 + 2 * q.x * q.x), d.p1 * (r2 + 2 * q.y * q.y) + 2 * d.p2 * xy};
}

double fov_factor(double omega, double r) {
    if (omega == 0) return 1;
    const double edge = 2 * std::tan(0.5 * omega);
    return r < 1e-9 ? edge / omega : std::atan(r * edge) / (r * omega);
}

glm::dvec2 bend_unsheared(const Distortion& d, glm::dvec2 q) {
    const double r2 = glm::dot(q, q);
    switch (d.lens) {
        case Lens::brown:
            return q * ((1 + polynomial(r2, d.k1, d.k2, d.k3)) / (1 + polynomial(r2, d.k4, d.k5, d.k6))) +
                   tangential(d, q) + glm::dvec2(polynomial(r2, d.s1, d.s2), polynomial(r2, d.s3, d.s4));
        case Lens::fisheye:
            return q * (1 + polynomial(r2, d.k1, d.k2, d.k3, d.k4, d.k5, d.k6)) + tangential(d, q) +
                   glm::dvec2(polynomial(r2, d.s1, d.s2), polynomial(r2, d.s3, d.s4));
        case Lens::radial4:
            return q * (1 + polynomial(r2, d.k1, d.k2, d.k3, d.k4)) + tangential(d, q);
        case Lens::fisheye624: {
            const glm::dvec2 p = q * (1 + polynomial(r2, d.k1, d.k2, d.k3, d.k4, d.k5, d.k6));
            const double p2 = glm::dot(p, p);
            return p + tangential(d, p) + glm::dvec2(polynomial(p2, d.s1, d.s2), polynomial(p2, d.s3, d.s4));
        }
        case Lens::fov:
            return q * fov_factor(d.k1, std::sqrt(r2));
        case Lens::division:
            return q * (2 / (1 + std::sqrt(1 - 4 * d.k1 * r2)));
        case Lens::unified:
            return q / (d.k1 * std::sqrt(d.k2 * r2 + 1) + 1 - d.k1);
        case Lens::equirectangular:
        case Lens::orthographic:
            break;  // no distortion of a plane
    }
    return q;
}

glm::dvec2 bend(const Distortion& d, glm::dvec2 q) {
    glm::dvec2 point = bend_unsheared(d, q);
    point.x += d.skew * point.y;
    return point;
}

glm::dvec2 plane_of_ray(const Distortion& d, glm::dvec2 ray) {
    const double r = glm::length(ray);
    return in_angles(d) && r > 1e-12 ? ray * (std::atan(r) / r) : ray;
}

std::optional<glm::dvec2> ray_of_plane(const Distortion& d, glm::dvec2 q) {
    const double r = glm::length(q);
    if (!in_angles(d)) return r < std::tan(kMaxAngle) ? std::optional(q) : std::nullopt;
    if (!(r < kMaxAngle)) return std::nullopt;
    return r > 1e-12 ? q * (std::tan(r) / r) : q;
}

/// d bend / d q by central differences. One formula serves every lens, exact to about 1e-10.
glm::dmat2 jacobian(const Distortion& d, glm::dvec2 q) {
    const double h = 1e-6 * std::max(1.0, glm::length(q));
    glm::dmat2 columns;
    for (int i = 0; i < 2; ++i) {
        glm::dvec2 step(0.0);
        step[i] = h;
        columns[i] = (bend(d, q + step) - bend(d, q - step)) / (2 * h);
    }
    return columns;
}

/// One shortened Newton step. False if no step gets nearer without a fold.
bool step_towards(const Distortion& d, glm::dvec2 point, glm::dvec2& q, double& distance) {
    glm::dvec2 step = glm::inverse(jacobian(d, q)) * (point - bend(d, q));
    // As in COLMAP's inversion: at most a tenth of the radius, so that no fold is crossed.
    const double longest = 0.1 * std::max(1.0, glm::length(q)), length = glm::length(step);
    if (length > longest) step *= longest / length;
    for (int cut = 0; cut < 40; ++cut, step *= 0.5) {
        const glm::dvec2 next = q + step;
        const double left = glm::length(bend(d, next) - point);
        if (left < distance && glm::determinant(jacobian(d, next)) > 0) {
            q = next;
            distance = left;
            return true;
        }
    }
    return false;
}

// COLMAP's bounds of the new size relative to the old.
constexpr double kMinScale = 0.2, kMaxScale = 2.0;
constexpr double kShrink = 0.98;

[[noreturn]] void fail_folded() {
    throw InputError(
        "the lens folds the image over itself, so it cannot be undistorted; check the distortion, and that "
        "the "
        "focal length and principal point are of this image's size, or undistort with another tool");
}

glm::dvec2 normalized(const Camera& camera, double x, double y) {
    return {(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy};
}

glm::dvec2 source_pixel(const Camera& source, const Distortion& distortion, glm::dvec2 ray) {
    const glm::dvec2 p = distort(distortion, ray);
    return {source.fx * p.x + source.cx, source.fy * p.y + source.cy};
}

/// The tangent of the innermost undistorted pixel of each side. Infinite if no ray reaches the side.
struct Inner {
    double left, right, top, bottom;
};

/// The largest of value(0) .. value(size - 1); a value is empty if no ray in front reaches that pixel. The
/// search uses steps that get finer around the best, because a file may claim any size and any number of
/// lenses. It includes `axis`, the pixel nearest to the principal point, which is visible even if most of the
/// side is not.
template <class Value>
double largest(int size, double axis, const Value& value) {
    constexpr int kSamples = 128;
    double best = -std::numeric_limits<double>::infinity();
    int at = 0;
    const auto visit = [&](int i) {
        const std::optional<double> found = value(i);
        if (!found || !(*found > best)) return;
        best = *found;
        at = i;
    };
    visit(static_cast<int>(std::clamp(axis, 0.0, size - 1.0)));
    for (int low = 0, high = size - 1, step = 0; step != 1;) {
        step = std::max(1, (high - low) / kSamples);
        for (int i = low; i < high; i += step) visit(i);
        visit(high);
        low = std::max(0, at - step);
        high = std::min(size - 1, at + step);
    }
    return best;
}

Inner inner_border(const Camera& source, const Distortion& distortion) {
    // A border pixel's ray along one axis. With this sign, the largest is the innermost.
    const auto ray = [&](double x, double y, int axis, double sign) -> std::optional<double> {
        const auto found = undistort(distortion, normalized(source, x, y));
        return found ? std::optional(sign * (*found)[axis]) : std::nullopt;
    };
    const double right = source.width - 0.5, bottom = source.height - 0.5;
    Inner inner;
    inner.left = largest(source.height, source.cy, [&](int y) { return ray(0.5, y + 0.5, 0, 1); });
    inner.right = -largest(source.height, source.cy, [&](int y) { return ray(right, y + 0.5, 0, -1); });
    inner.top = largest(source.width, source.cx, [&](int x) { return ray(x + 0.5, 0.5, 1, 1); });
    inner.bottom = -largest(source.width, source.cx, [&](int x) { return ray(x + 0.5, bottom, 1, -1); });
    return inner;
}

/// The new size relative to the old along an axis. low and high are the inner border as tangents, infinite if
/// no ray in front reaches it. A fisheye sees to the side and behind. A perspective lens that does so on both
/// sides has folded.
double axis_scale(const Distortion& distortion, double focal, double center, int size, double low,
                  double high) {
    const bool none = std::isinf(low) && std::isinf(high);
    if (!(low < 0 && high > 0) || (none && distortion.lens == Lens::brown)) fail_folded();
    const double scale = std::min(-low * focal / center, high * focal / (size - 0.5 - center));
    if (!(scale > 0)) fail_folded();
    return std::clamp(scale, kMinScale, kMaxScale);
}

Camera scaled(const Camera& source, double scale_x, double scale_y) {
    Camera camera = source;
    camera.width = std::max(1, static_cast<int>(scale_x * source.width));
    camera.height = std::max(1, static_cast<int>(scale_y * source.height));
    camera.cx *= double(camera.width) / source.width;
    camera.cy *= double(camera.height) / source.height;
    return camera;
}

/// Whether the source covers the whole new image, and the model folds nowhere in it. `first` is the point to
/// test first; it becomes the point that failed, because a slightly smaller image mostly fails there again.
bool covers(const Camera& source, const Distortion& distortion, const Camera& camera, glm::ivec2& first) {
    constexpr int kSteps = 64;
    const auto holds = [&](int i, int j) {
        const glm::dvec2 ray = normalized(camera, 0.5 + i * (camera.width - 1.0) / kSteps,
                                          0.5 + j * (camera.height - 1.0) / kSteps);
        const glm::dvec2 p = source_pixel(source, distortion, ray);
        return p.x >= 0 && p.x <= source.width && p.y >= 0 && p.y <= source.height &&
               one_to_one(distortion, ray);
    };
    if (!holds(first.x, first.y)) return false;
    for (int j = 0; j <= kSteps; ++j)
        for (int i = 0; i <= kSteps; ++i)
            if (!holds(i, j)) {
                first = {i, j};
                return false;
            }
    return true;
}

}  // namespace

glm::dvec2 distort(const Distortion& lens, glm::dvec2 ray) {
    return bend(lens, plane_of_ray(lens, ray));
}

std::optional<glm::dvec2> undistort(const Distortion& lens, glm::dvec2 point) {
    glm::dvec2 q(0.0);
    double distance = glm::length(point);
    const double near = 1e-13 * (1 + distance);
    for (int i = 0; i < 200 && !(distance <= near); ++i)
        if (!step_towards(lens, point, q, distance)) return std::nullopt;
    return distance <= near ? ray_of_plane(lens, q) : std::nullopt;
}

bool one_to_one(const Distortion& lens, glm::dvec2 ray) {
    return glm::determinant(jacobian(lens, plane_of_ray(lens, ray))) > 0;
}

Distortion for_longer_focal(Distortion d, double factor) {
    if (d.lens != Lens::brown) return d;
    const double square = factor * factor;
    for (double* linear : {&d.p1, &d.p2}) *linear *= factor;
    for (double* second : {&d.k1, &d.k4}) *second *= square;
    for (double* fourth : {&d.k2, &d.k5}) *fourth *= square * square;
    for (double* sixth : {&d.k3, &d.k6}) *sixth *= square * square * square;
    return d;
}

Camera undistorted_camera(const Camera& source, const Distortion& distortion) {
    if (distortion.none()) return source;
    if (!has_pinhole(distortion.lens))
        throw InputError("a pinhole cannot show these images; take --lens native");
    if (source.width < 2 || source.height < 2)
        throw InputError("a distorted image needs at least 2 x 2 pixels");
    if (!(source.cx > 0 && source.cx < source.width && source.cy > 0 && source.cy < source.height))
        throw InputError(
            "the principal point lies outside the image, which cannot be undistorted then; check it and the "
            "image's size, or take --lens native or another tool");
    const Inner inner = inner_border(source, distortion);
    double x = axis_scale(distortion, source.fx, source.cx, source.width, inner.left, inner.right);
    double y = axis_scale(distortion, source.fy, source.cy, source.height, inner.top, inner.bottom);
    for (glm::ivec2 first(0);;) {
        const Camera camera = scaled(source, x, y);
        if (covers(source, distortion, camera, first)) return camera;
        x *= kShrink;
        y *= kShrink;
        if (x < kMinScale * kShrink && y < kMinScale * kShrink) fail_folded();
    }
}

glm::dvec2 source_pixel(const Camera& source, const Distortion& distortion, const Camera& camera,
                        const glm::dvec2& pixel) {
    return source_pixel(source, distortion, normalized(camera, pixel.x, pixel.y));
}

Image undistort_image(const Image& image, const Camera& source, const Distortion& distortion,
                      const Camera& camera) {
    Image result(camera.width, camera.height, image.channels);
    for (int y = 0; y < result.height; ++y)
        for (int x = 0; x < result.width; ++x) {
            const glm::dvec2 p = source_pixel(source, distortion, normalized(camera, x + 0.5, y + 0.5));
            // Clamped to the centres of the outermost pixels, so there are always four neighbours.
            const double u = std::clamp(p.x - 0.5, 0.0, image.width - 1.0);
            const double v = std::clamp(p.y - 0.5, 0.0, image.height - 1.0);
            const int x0 = std::min(int(u), image.width - 2), y0 = std::min(int(v), image.height - 2);
            const double a = u - x0, b = v - y0;
            for (int c = 0; c < image.channels; ++c) {
                const double top =
                    (1 - a) * double(image.at(x0, y0)[c]) + a * double(image.at(x0 + 1, y0)[c]);
                const double bottom =
                    (1 - a) * double(image.at(x0, y0 + 1)[c]) + a * double(image.at(x0 + 1, y0 + 1)[c]);
                result.at(x, y)[c] = static_cast<float>((1 - b) * top + b * bottom);
            }
        }
    return result;
}

}  // namespace ewa::scene
