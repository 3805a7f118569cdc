// SPDX-License-Identifier: Apache-2.0
#include "reference/project_backward.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "reference/spherical_harmonics.h"
#include "shared/constants.h"

namespace ewa::reference {

using namespace shared;

namespace {

/// dL/ddet0 and dL/dtrace given dL/dfactor, where det = det0 + LOW_PASS * trace + LOW_PASS^2.
struct DetGradient {
    double det0 = 0, trace = 0;
};

DetGradient kernel_backward(Footprint kernel, const ProjectionSteps& s, double det, double by_factor) {
    switch (kernel) {
        case Footprint::peak:
            return {};
        case Footprint::antialias: {
            // sqrt(det0 / det); det0 > 0, or the factor were zero and the splat not visible.
            const double by_det = -0.5 * s.kernel_factor / det;
            return {by_factor * (0.5 / std::sqrt(s.det0 * det) + by_det), by_factor * by_det * LOW_PASS};
        }
        case Footprint::unit_mass: {
            const double by_det = -0.5 * s.kernel_factor / det;
            return {by_factor * by_det, by_factor * by_det * LOW_PASS};
        }
    }
    return {};
}

Rows m_gradient(const ProjectionSteps& s, const ScreenGradient& g, const DetGradient& det) {
    const Rows& m = s.m;
    Rows out;
    out.x = 2 * g.a * m.x + g.b * m.y;
    out.y = g.b * m.x + 2 * g.c * m.y;
    const glm::dvec3 n = glm::cross(m.x, m.y);
    out.x += 2 * det.det0 * glm::cross(m.y, n) + 2 * det.trace * m.x;
    out.y += 2 * det.det0 * glm::cross(n, m.x) + 2 * det.trace * m.y;
    return out;
}

/// dL/d(unit quaternion) from dL/dR, the derivative of rotation_matrix(); r[column][row] as glm has it.
std::array<double, 4> rotation_backward(const std::array<double, 4>& q, const glm::dmat3& r) {
    const auto [w, x, y, z] = q;
    return {2 * (x * (r[1][2] - r[2][1]) + y * (r[2][0] - r[0][2]) + z * (r[0][1] - r[1][0])),
            2 * (y * (r[0][1] + r[1][0]) + z * (r[0][2] + r[2][0]) + w * (r[1][2] - r[2][1]) -
                 2 * x * (r[1][1] + r[2][2])),
            2 * (x * (r[0][1] + r[1][0]) + z * (r[1][2] + r[2][1]) + w * (r[2][0] - r[0][2]) -
                 2 * y * (r[0][0] + r[2][2])),
            2 * (x * (r[0][2] + r[2][0]) + y * (r[1][2] + r[2][1]) + w * (r[0][1] - r[1][0]) -
                 2 * z * (r[0][0] + r[1][1]))};
}

void shape_backward(const ProjectionSteps& s, const Rows& by_m, Splat& out) {
    // dL/d(R S), column k = by axis k.
    glm::dmat3 by_rs(0);
    for (int k = 0; k < 3; ++k) by_rs[k] = s.screen.x * by_m.x[k] + s.screen.y * by_m.y[k];
    glm::dmat3 by_r(0);
    for (int k = 0; k < 3; ++k) {
        by_r[k] = by_rs[k] * s.scale[k];
        out.log_scale[k] = s.scale[k] * glm::dot(s.rotation[k], by_rs[k]);
    }
    const std::array<double, 4> by_unit = rotation_backward(s.unit_quaternion, by_r);
    double along = 0;
    for (int k = 0; k < 4; ++k) along += s.unit_quaternion[k] * by_unit[k];
    for (int k = 0; k < 4; ++k)
        out.quaternion[k] = (by_unit[k] - s.unit_quaternion[k] * along) / s.quaternion_norm;
}

/// dL/d(view position) through mean2d and through J.
glm::dvec3 view_backward(const ProjectionSteps& s, const Camera& camera, const ScreenGradient& g,
                         const Rows& by_m) {
    const double z = s.view.z, fx = camera.fx, fy = camera.fy;
    glm::dvec3 by_view{g.mean2d.x * fx / z, g.mean2d.y * fy / z, 0};
    by_view.z = -(g.mean2d.x * fx * s.view.x + g.mean2d.y * fy * s.view.y) / (z * z);

    // dL/dJ = dL/dM (W R S)^T, row by row.
    const glm::dmat3 wrs =
        camera.rotation *
        glm::dmat3(s.rotation[0] * s.scale[0], s.rotation[1] * s.scale[1], s.rotation[2] * s.scale[2]);
    const glm::dvec3 by_jx = wrs * by_m.x, by_jy = wrs * by_m.y;
    // J's entries are fx/z and -fx tx/z; the slope tx = x/z moves with x and z unless it is clamped.
    by_view.z += -(fx * by_jx.x + fy * by_jy.y) / (z * z);
    by_view.z += (fx * s.slope.x * by_jx.z + fy * s.slope.y * by_jy.z) / (z * z);
    const double by_slope_x = s.slope_free.x ? -fx / z * by_jx.z : 0;
    const double by_slope_y = s.slope_free.y ? -fy / z * by_jy.z : 0;
    by_view.x += by_slope_x / z;
    by_view.y += by_slope_y / z;
    by_view.z += -(by_slope_x * s.view.x + by_slope_y * s.view.y) / (z * z);
    return by_view;
}

/// Fills in the coefficients' gradient and returns dL/d(mean - camera position) through the direction.
glm::dvec3 color_backward(const Splat& splat, const ProjectionSteps& s, const glm::dvec3& gradient,
                          Splat& out) {
    glm::dvec3 by_color(0);
    for (int k = 0; k < 3; ++k) by_color[k] = s.raw_color[k] > 0 ? gradient[k] : 0;
    const auto basis = sh_basis(s.sh_degree, s.direction);
    const auto basis_gradient = sh_basis_gradient(s.sh_degree, s.direction);
    glm::dvec3 by_direction(0);
    for (int j = 0; j < sh_coefficients(s.sh_degree); ++j) {
        out.sh[j] = basis[j] * by_color;
        by_direction += glm::dot(by_color, splat.sh[j]) * basis_gradient[j];
    }
    return (by_direction - s.direction * glm::dot(s.direction, by_direction)) / glm::length(s.offset);
}

}  // namespace

Splat project_backward(const Splat& splat, const Camera& camera, const RenderOptions& options,
                       const ScreenGradient& gradient) {
    Splat out;
    out.sh_degree = splat.sh_degree;
    ProjectionSteps s;
    const Projected projected = project(splat, camera, options, &s);
    if (!projected.visible) return out;

    const DetGradient by_det =
        kernel_backward(options.kernel, s, projected.det, gradient.opacity * s.sigmoid);
    const Rows by_m = m_gradient(s, gradient, by_det);
    shape_backward(s, by_m, out);
    out.opacity_logit = gradient.opacity * s.kernel_factor * s.sigmoid * (1 - s.sigmoid);
    const glm::dvec3 by_offset = color_backward(splat, s, gradient.color, out);
    out.mean = glm::transpose(camera.rotation) * view_backward(s, camera, gradient, by_m) + by_offset;
    return out;
}

}  // namespace ewa::reference
