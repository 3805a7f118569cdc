// SPDX-License-Identifier: Apache-2.0
#include "reference/plain_projection.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>
#include <glm/matrix.hpp>

#include "reference/lens.h"
#include "reference/projection.h"
#include "shared/constants.h"

namespace ewa::reference {

using namespace shared;

namespace {

struct PlainSteps {
    glm::dvec3 p{0};
    std::optional<LensImage> image;  // of a lens; else slope and slope_free are set
    glm::dvec2 slope{0};
    glm::bvec2 slope_free{true};
    std::array<double, 4> unit_quaternion{};
    double norm = 1;
    glm::dmat3 axes{0};  // Q S
    glm::dmat3 sigma{0};
    Rows j, t;  // J, T
    double a0 = 0, b = 0, c0 = 0, det0 = 0, det = 0;
};

glm::dmat3 cofactors(const glm::dmat3& m) {
    return {glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1])};
}

PlainSteps plain_steps(const PlainSplat& splat, const PlainView& view, const PlainOptions& options) {
    PlainSteps s;
    s.p = view.rotation * splat.mean + view.translation;
    const int size[2] = {int(options.width), int(options.height)};
    if (view.lens.none()) {
        for (int k = 0; k < 2; ++k)
            s.slope[k] = clamp_slope(s.p[k] / s.p.z, view.focal[k], view.center[k], size[k], s.slope_free[k]);
        s.j = {view.focal.x / s.p.z * glm::dvec3(1, 0, -s.slope.x),
               view.focal.y / s.p.z * glm::dvec3(0, 1, -s.slope.y)};
    } else {
        const bool fisheye = view.lens.lens == Lens::fisheye;  // the image's size does not limit its angles
        s.image = lens_image({.width = fisheye ? 1 << 24 : size[0],
                              .height = fisheye ? 1 << 24 : size[1],
                              .fx = view.focal.x,
                              .fy = view.focal.y,
                              .cx = view.center.x,
                              .cy = view.center.y,
                              .distortion = view.lens},
                             s.p);
        s.j = s.image->jacobian;
    }
    s.t = {s.j.x * view.rotation, s.j.y * view.rotation};
    const glm::dvec3 n = glm::cross(s.t.x, s.t.y);
    if (splat.has_covariance) {
        const auto& c = splat.covariance;
        s.sigma = {c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5]};
        s.det0 = glm::dot(n, cofactors(s.sigma) * n);
    } else {
        s.norm = robust_norm(splat.quaternion);
        for (size_t k = 0; k < 4; ++k) s.unit_quaternion[k] = splat.quaternion[k] / s.norm;
        s.axes = rotation_matrix(s.unit_quaternion);
        for (int k = 0; k < 3; ++k) s.axes[k] *= splat.scale[k];
        s.sigma = s.axes * glm::transpose(s.axes);
        const glm::dvec3 minors = n * cofactors(s.axes);
        s.det0 = glm::dot(minors, minors);
    }
    s.a0 = glm::dot(s.t.x, s.sigma * s.t.x);
    s.b = glm::dot(s.t.x, s.sigma * s.t.y);
    s.c0 = glm::dot(s.t.y, s.sigma * s.t.y);
    s.det = s.det0 + options.low_pass * (s.a0 + s.c0) + options.low_pass * options.low_pass;
    return s;
}

glm::dvec3 whitener_of(const PlainSteps& s, double c) {
    return {std::sqrt(c / (2 * s.det)), s.b / c, std::sqrt(1 / (2 * c))};
}

/// dL/dconic of dL/dwhitener: ux = sqrt(A / 2), k = -B / A, vy = sqrt((C - B^2 / A) / 2).
glm::dvec3 conic_gradient(const PlainSteps& s, double c, const glm::dvec3& by_whitener) {
    const glm::dvec3 w = whitener_of(s, c);
    const double by_vy = by_whitener.z / (4 * w.z), by_k = by_whitener.y / (2 * w.x * w.x);
    return {by_whitener.x / (4 * w.x) - by_k * w.y + by_vy * w.y * w.y, -by_k + 2 * by_vy * w.y, by_vy};
}

/// dL/dSigma2 as a symmetric matrix.
glm::dmat2 covariance_gradient(const PlainSteps& s, const PlainOptions& options, PlainScreenGradient g) {
    const double low_pass = options.low_pass, a = s.a0 + low_pass, c = s.c0 + low_pass;
    if (options.whiteners) g.conic = conic_gradient(s, c, g.conic);
    const glm::dmat2 conic = glm::dmat2(c, -s.b, -s.b, a) / s.det;
    const glm::dmat2 by_conic(g.conic.x, g.conic.y / 2, g.conic.y / 2, g.conic.z);
    glm::dmat2 out = -(conic * by_conic * conic);
    if (s.det0 > 0 && g.compensation != 0) {
        const double half = 0.5 * g.compensation * std::sqrt(s.det0 / s.det);
        out += half * (1 / s.det0 - 1 / s.det) * glm::dmat2(s.c0, -s.b, -s.b, s.a0) -
               half * low_pass / s.det * glm::dmat2(1.0);
    }
    return out;
}

/// dL/dp through mean2d, through the depth and through J.
glm::dvec3 point_gradient(const PlainSteps& s, const PlainView& view, const PlainScreenGradient& g,
                          const Rows& by_j) {
    const double z = s.p.z;
    glm::dvec3 out(0, 0, g.depth);
    const glm::dvec3 by[2] = {by_j.x, by_j.y};
    if (s.image) {
        out += g.mean2d.x * s.image->exact.x + g.mean2d.y * s.image->exact.y;
        for (size_t row = 0; row < 2; ++row)
            for (size_t column = 0; column < 3; ++column)
                out += by[row][int(column)] * s.image->hessian[row][column];
        return out;
    }
    for (int k = 0; k < 2; ++k) {
        const double f = view.focal[k];
        out[k] += g.mean2d[k] * f / z;
        out.z -= g.mean2d[k] * f * s.p[k] / (z * z);
        out.z -= f / (z * z) * (by[k][k] - s.slope[k] * by[k].z);
        if (!s.slope_free[k]) continue;
        out[k] -= f / (z * z) * by[k].z;
        out.z += f * s.p[k] / (z * z * z) * by[k].z;
    }
    return out;
}

}  // namespace

PlainProjected project(const PlainSplat& splat, const PlainView& view, const PlainOptions& options) {
    const PlainSteps s = plain_steps(splat, view, options);
    PlainProjected out;
    out.depth = s.p.z;
    out.mean2d = s.image ? s.image->pixel : view.focal * glm::dvec2(s.p) / s.p.z + view.center;
    const double a = s.a0 + options.low_pass, c = s.c0 + options.low_pass;
    out.conic = options.whiteners ? whitener_of(s, c) : glm::dvec3(c, -s.b, a) / s.det;
    out.compensation = std::sqrt(std::max(0.0, s.det0 / s.det));
    const double factor = options.compensations ? out.compensation : 1;
    const double ratio = splat.opacity ? *splat.opacity * factor / ALPHA_MIN : HUGE_VAL;
    const double sigmas = std::min(RADIUS_SIGMAS, std::sqrt(2 * std::log(std::max(ratio, 1.0))));
    out.reach = sigmas * glm::sqrt(glm::dvec2(a, c));
    const glm::dvec2 radius = glm::ceil(out.reach);
    out.visible = (!s.image || s.image->shown) && s.p.z > options.near && s.p.z < options.far && s.det > 0 &&
                  ratio >= 1 && (radius.x > options.radius_clip || radius.y > options.radius_clip) &&
                  out.mean2d.x + radius.x > 0 && out.mean2d.x - radius.x < options.width &&
                  out.mean2d.y + radius.y > 0 && out.mean2d.y - radius.y < options.height;
    return out;
}

PlainGradient project_backward(const PlainSplat& splat, const PlainView& view, const PlainOptions& options,
                               const PlainScreenGradient& gradient) {
    const PlainSteps s = plain_steps(splat, view, options);
    const glm::dmat2 g = covariance_gradient(s, options, gradient);
    const Rows gt{g[0][0] * s.t.x + g[1][0] * s.t.y, g[0][1] * s.t.x + g[1][1] * s.t.y};
    const Rows by_t{2.0 * (s.sigma * gt.x), 2.0 * (s.sigma * gt.y)};
    const glm::dmat3 by_sigma = glm::outerProduct(s.t.x, gt.x) + glm::outerProduct(s.t.y, gt.y);

    PlainGradient out;
    const Rows by_j{view.rotation * by_t.x, view.rotation * by_t.y};
    out.translation = point_gradient(s, view, gradient, by_j);
    out.rotation = glm::outerProduct(out.translation, splat.mean) + glm::outerProduct(s.j.x, by_t.x) +
                   glm::outerProduct(s.j.y, by_t.y);
    out.splat.mean = out.translation * view.rotation;
    if (splat.has_covariance) {
        out.splat.has_covariance = true;
        out.splat.covariance = {by_sigma[0][0], 2 * by_sigma[0][1], 2 * by_sigma[0][2],
                                by_sigma[1][1], 2 * by_sigma[1][2], by_sigma[2][2]};
        return out;
    }
    glm::dmat3 by_rotation(0);
    const glm::dmat3 rotation = rotation_matrix(s.unit_quaternion), by_axes = 2.0 * by_sigma * s.axes;
    for (int k = 0; k < 3; ++k) {
        by_rotation[k] = by_axes[k] * splat.scale[k];
        out.splat.scale[k] = glm::dot(rotation[k], by_axes[k]);
    }
    const std::array<double, 4> by_unit = rotation_backward(s.unit_quaternion, by_rotation);
    double along = 0;
    for (size_t k = 0; k < 4; ++k) along += s.unit_quaternion[k] * by_unit[k];
    for (size_t k = 0; k < 4; ++k)
        out.splat.quaternion[k] = (by_unit[k] - s.unit_quaternion[k] * along) / s.norm;
    return out;
}

}  // namespace ewa::reference
