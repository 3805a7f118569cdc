// SPDX-License-Identifier: Apache-2.0
#include "scene/lens.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>
#include <numbers>

namespace ewa::scene {

namespace {

// Rays farther from the axis than this are not in front of a pinhole camera in any useful sense (a tangent of
// 1000).
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

glm::dvec2 bend(const Distortion& d, glm::dvec2 q) {
    const double r2 = glm::dot(q, q);
    switch (d.lens) {
        case Lens::brown:
            return q * ((1 + polynomial(r2, d.k1, d.k2, d.k3)) / (1 + polynomial(r2, d.k4, d.k5, d.k6))) +
                   tangential(d, q);
        case Lens::fisheye:
            return q * (1 + polynomial(r2, d.k1, d.k2, d.k3, d.k4)) + tangential(d, q) +
                   r2 * glm::dvec2(d.s1, d.s3);
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
    }
    return q;
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

/// d bend / d q by central differences: one formula for every lens, exact to about 1e-10.
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

/// One cut Newton step, or false where none gets nearer without leaving the sheet of the axis.
bool step_towards(const Distortion& d, glm::dvec2 point, glm::dvec2& q, double& distance) {
    glm::dvec2 step = glm::inverse(jacobian(d, q)) * (point - bend(d, q));
    // As COLMAP's own inversion does: a tenth of the radius at most, so that no fold is stepped over.
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

}  // namespace ewa::scene
