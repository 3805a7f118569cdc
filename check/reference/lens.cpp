// SPDX-License-Identifier: Apache-2.0
#include "reference/lens.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "scene/native_lens.h"
#include "shared/constants.h"

namespace ewa::reference {

using namespace shared;
namespace {

/// A function of two or three variables, with its first and second derivatives.
struct Second {
    double value = 0;
    glm::dvec3 gradient{0};
    glm::dmat3 hessian{0};
};

Second variable(int i, double value) {
    Second v{value};
    v.gradient[i] = 1;
    return v;
}

Second constant(double value) {
    return {value};
}

/// f(a), given f and its derivatives at a.
Second composed(const Second& a, double f, double f1, double f2) {
    return {f, f1 * a.gradient, f1 * a.hessian + f2 * glm::outerProduct(a.gradient, a.gradient)};
}

Second operator+(const Second& a, const Second& b) {
    return {a.value + b.value, a.gradient + b.gradient, a.hessian + b.hessian};
}

Second operator*(const Second& a, const Second& b) {
    return {a.value * b.value, a.value * b.gradient + b.value * a.gradient,
            a.value * b.hessian + b.value * a.hessian + glm::outerProduct(a.gradient, b.gradient) +
                glm::outerProduct(b.gradient, a.gradient)};
}

Second operator*(double s, const Second& a) {
    return {s * a.value, s * a.gradient, s * a.hessian};
}

Second inverse(const Second& a) {
    const double r = 1 / a.value;
    return composed(a, r, -r * r, 2 * r * r * r);
}

Second root(const Second& a) {
    const double r = std::sqrt(a.value);
    return composed(a, r, 0.5 / r, -0.25 / (r * a.value));
}

/// atan2(y, x).
Second angle(const Second& y, const Second& x) {
    const double q = x.value * x.value + y.value * y.value;
    // Derivatives by (y, x).
    const double by_y = x.value / q, by_x = -y.value / q;
    const double yy = -2 * x.value * y.value / (q * q), xx = -yy,
                 xy = (y.value * y.value - x.value * x.value) / (q * q);
    Second out{std::atan2(y.value, x.value), by_y * y.gradient + by_x * x.gradient};
    out.hessian =
        by_y * y.hessian + by_x * x.hessian + yy * glm::outerProduct(y.gradient, y.gradient) +
        xx * glm::outerProduct(x.gradient, x.gradient) +
        xy * (glm::outerProduct(y.gradient, x.gradient) + glm::outerProduct(x.gradient, y.gradient));
    return out;
}

struct Plane {
    Second u, v;  // before focal lengths and principal point
};

/// 1 + c1 w + c2 w^2 + ...
template <class... Coefficients>
Second one_and(const Second& w, Coefficients... coefficients) {
    Second sum = constant(1), power = constant(1);
    for (const double c : {coefficients...}) {
        power = power * w;
        sum = sum + c * power;
    }
    return sum;
}

/// distort((a, b)) as in src/scene/lens.h, with the thin prism of OpenCV.
Plane brown(const Distortion& d, const Second& a, const Second& b) {
    const Second w = a * a + b * b, ab = a * b;
    const Second radial = one_and(w, d.k1, d.k2, d.k3) * inverse(one_and(w, d.k4, d.k5, d.k6));
    return {radial * a + (2 * d.p1) * ab + d.p2 * (w + 2.0 * (a * a)) + d.s1 * w + d.s2 * (w * w),
            radial * b + d.p1 * (w + 2.0 * (b * b)) + (2 * d.p2) * ab + d.s3 * w + d.s4 * (w * w)};
}

Plane fisheye(const Distortion& d, const glm::dvec3& p) {
    const Second x = variable(0, p.x), y = variable(1, p.y), z = variable(2, p.z);
    if (p.x == 0 && p.y == 0) {
        // u = x / z (1 + (k1 - 1/3) r^2 / z^2 + ...): on the axis only the first term has first and second derivatives.
        return {x * inverse(z), y * inverse(z)};
    }
    const Second r = root(x * x + y * y), t = angle(r, z);
    const Second factor = t * one_and(t * t, d.k1, d.k2, d.k3, d.k4) * inverse(r);
    return {factor * x, factor * y};
}

Plane equirectangular(const glm::dvec3& p) {
    const Second x = variable(0, p.x), y = variable(1, p.y), z = variable(2, p.z);
    return {angle(x, z), angle(y, root(x * x + z * z))};
}

Rows rows(const Plane& plane, double fx, double fy) {
    return {fx * plane.u.gradient, fy * plane.v.gradient};
}

/// What is searched for once a camera: a search takes longer than a projection.
struct Bounds {
    Camera camera;
    double limit = 0;
    scene::TangentBounds tangents{};
};

const Bounds& bounds_of(const Camera& c) {
    thread_local Bounds known;
    const Camera& k = known.camera;
    const bool same = k.width == c.width && k.height == c.height && k.fx == c.fx && k.fy == c.fy &&
                      k.cx == c.cx && k.cy == c.cy && k.distortion == c.distortion;
    if (!same) known = {c, scene::lens_limit(c), scene::tangent_bounds(c)};
    return known;
}

/// The derivatives of rows by p, at a depth of z. A tangent that is not free is constant in its own derivative.
std::array<std::array<glm::dvec3, 3>, 2> tangent_hessian(const Camera& camera, double z, const Second& u,
                                                         const Second& v, const Rows& rows,
                                                         glm::dvec2 tangent, glm::bvec2 is_free) {
    std::array<std::array<glm::dvec3, 3>, 2> out{};
    for (int i = 0; i < 2; ++i) {
        const Second& q = i == 0 ? u : v;
        const double scale = (i == 0 ? camera.fx : camera.fy) / z;
        const glm::dvec3& j = i == 0 ? rows.x : rows.y;
        for (int c = 0; c < 3; ++c) {
            glm::dvec3& by_point = out[size_t(i)][size_t(c)];
            by_point = {0, 0, -j[c] / z};
            for (int k = 0; k < 2; ++k) {
                if (!is_free[k]) continue;
                const double slope =
                    c < 2 ? q.hessian[k][c]
                          : -(q.hessian[k][0] * tangent.x + q.hessian[k][1] * tangent.y + q.gradient[k]);
                // d(tangent k)/dp = (1, -tangent) / z.
                by_point[k] += scale * slope / z;
                by_point.z -= scale * slope * tangent[k] / z;
            }
        }
    }
    return out;
}

/// By tangents: d(a, b)/dp, where a clamped tangent is constant in its own derivative.
void through_tangents(const Camera& camera, const glm::dvec3& p, LensImage& out) {
    const scene::TangentBounds& bounds = bounds_of(camera).tangents;
    const glm::dvec2 given(p.x / p.z, p.y / p.z), tangent = glm::clamp(given, bounds.low, bounds.high);
    const glm::bvec2 is_free(given.x == tangent.x, given.y == tangent.y);
    const auto rows_of = [&](const Plane& plane, glm::dvec2 t) {
        const auto row = [&](const Second& q, double focal) {
            return focal / p.z *
                   glm::dvec3(q.gradient.x, q.gradient.y, -(q.gradient.x * t.x + q.gradient.y * t.y));
        };
        return Rows{row(plane.u, camera.fx), row(plane.v, camera.fy)};
    };
    const auto plane_of = [&](glm::dvec2 t) {
        return brown(camera.distortion, variable(0, t.x), variable(1, t.y));
    };
    const Plane exact = plane_of(given), plane = plane_of(tangent);
    out.pixel = {camera.fx * exact.u.value + camera.cx, camera.fy * exact.v.value + camera.cy};
    out.exact = rows_of(exact, given);
    out.jacobian = rows_of(plane, tangent);
    out.hessian = tangent_hessian(camera, p.z, plane.u, plane.v, out.jacobian, tangent, is_free);
    out.exact_hessian = tangent_hessian(camera, p.z, exact.u, exact.v, out.exact, given, glm::bvec2(true));
}

}  // namespace

LensImage lens_image(const Camera& camera, const glm::dvec3& p) {
    LensImage out;
    const Lens lens = camera.distortion.lens;
    out.depth = scene::ordered_by_distance(lens) ? glm::length(p) : p.z;
    if (!(out.depth > NEAR_PLANE)) return out;
    const double limit = bounds_of(camera).limit;
    if (lens == Lens::brown) {
        const double x = p.x / p.z, y = p.y / p.z;
        if (!(x * x + y * y <= limit)) return out;
        out.shown = true;
        through_tangents(camera, p, out);
        return out;
    }
    if (lens == Lens::fisheye && !(std::atan2(std::hypot(p.x, p.y), p.z) <= limit)) return out;
    if (lens == Lens::equirectangular && p.x == 0 && p.z == 0) return out;
    out.shown = true;
    const Plane plane = lens == Lens::fisheye           ? fisheye(camera.distortion, p)
                        : lens == Lens::equirectangular ? equirectangular(p)
                                                        : Plane{variable(0, p.x), variable(1, p.y)};
    out.pixel = {camera.fx * plane.u.value + camera.cx, camera.fy * plane.v.value + camera.cy};
    out.exact = out.jacobian = rows(plane, camera.fx, camera.fy);
    for (int i = 0; i < 2; ++i)
        for (int c = 0; c < 3; ++c)
            out.hessian[size_t(i)][size_t(c)] =
                (i == 0 ? camera.fx * plane.u.hessian[c] : camera.fy * plane.v.hessian[c]);
    out.exact_hessian = out.hessian;
    return out;
}

}  // namespace ewa::reference
