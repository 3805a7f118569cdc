// SPDX-License-Identifier: Apache-2.0
#include "reference/projection.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numbers>

#include "scene/native_lens.h"
#include "scene/readout.h"
#include "shared/constants.h"

namespace ewa::reference {

using namespace shared;

std::array<glm::dvec3, kMaxCoefficients> sh_basis_gradient(int degree, const glm::dvec3& direction) {
    const double x = direction.x, y = direction.y, z = direction.z;
    const double xx = x * x, yy = y * y, zz = z * z, xy = x * y, xz = x * z, yz = y * z;
    std::array<glm::dvec3, kMaxCoefficients> gradient{};
    if (degree < 1) return gradient;
    gradient[1] = {0, -SH_C1, 0};
    gradient[2] = {0, 0, SH_C1};
    gradient[3] = {-SH_C1, 0, 0};
    if (degree < 2) return gradient;
    gradient[4] = SH_C2_0 * glm::dvec3(y, x, 0);
    gradient[5] = SH_C2_1 * glm::dvec3(0, z, y);
    gradient[6] = SH_C2_2 * glm::dvec3(-2 * x, -2 * y, 4 * z);
    gradient[7] = SH_C2_3 * glm::dvec3(z, 0, x);
    gradient[8] = SH_C2_4 * glm::dvec3(2 * x, -2 * y, 0);
    if (degree < 3) return gradient;
    gradient[9] = SH_C3_0 * glm::dvec3(6 * xy, 3 * xx - 3 * yy, 0);
    gradient[10] = SH_C3_1 * glm::dvec3(yz, xz, xy);
    gradient[11] = SH_C3_2 * glm::dvec3(-2 * xy, 4 * zz - xx - 3 * yy, 8 * yz);
    gradient[12] = SH_C3_3 * glm::dvec3(-6 * xz, -6 * yz, 6 * zz - 3 * xx - 3 * yy);
    gradient[13] = SH_C3_4 * glm::dvec3(4 * zz - 3 * xx - yy, -2 * xy, 8 * xz);
    gradient[14] = SH_C3_5 * glm::dvec3(2 * xz, -2 * yz, xx - yy);
    gradient[15] = SH_C3_6 * glm::dvec3(3 * xx - 3 * yy, -6 * xy, 0);
    return gradient;
}

double robust_norm(const std::array<double, 4>& q) {
    double largest = 0;
    for (double v : q) largest = std::max(largest, std::abs(v));
    if (!(largest > 0)) return 0;
    double sum = 0;
    for (double v : q) sum += (v / largest) * (v / largest);
    return largest * std::sqrt(sum);
}

glm::dmat3 rotation_matrix(const std::array<double, 4>& q) {
    const auto [w, x, y, z] = q;
    // glm takes columns.
    return {1 - 2 * (y * y + z * z), 2 * (x * y + w * z),     2 * (x * z - w * y),
            2 * (x * y - w * z),     1 - 2 * (x * x + z * z), 2 * (y * z + w * x),
            2 * (x * z + w * y),     2 * (y * z - w * x),     1 - 2 * (x * x + y * y)};
}

// r[column][row] as glm has it.
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

double clamp_slope(double slope, double focal, double principal, int size, bool& free) {
    const double margin = JACOBIAN_MARGIN * size / (2 * focal);
    const double low = -(principal / focal + margin);
    const double high = (size - principal) / focal + margin;
    free = slope >= low && slope <= high;
    return std::clamp(slope, low, high);
}

double raw_of(const Projected& splat, double opacity) {
    return splat.density ? -std::log1p(-opacity) : opacity;
}

double softplus(double x) {
    return std::max(x, 0.0) + std::log1p(std::exp(-std::abs(x)));
}

namespace {

/// Least scale / scale: the products of the other two scales, divided by the largest of these.
glm::dvec3 pair_ratios(const glm::dvec3& scale) {
    return std::min({scale.x, scale.y, scale.z}) / scale;
}

}  // namespace

double mean_shadow(const glm::dvec3& scale) {
    const double least = std::min({scale.x, scale.y, scale.z});
    return scale.x * scale.y * scale.z / least * glm::length(pair_ratios(scale)) / std::numbers::sqrt3;
}

namespace {

bool stored_values_usable(const Splat& splat) {
    for (int k = 0; k < 3; ++k)
        if (!std::isfinite(splat.mean[k]) || !std::isfinite(splat.log_scale[k])) return false;
    for (double v : splat.quaternion)
        if (!std::isfinite(v)) return false;
    return std::isfinite(splat.opacity_logit) && robust_norm(splat.quaternion) >= QUATERNION_MIN;
}

/// False for NaN.
bool within(double most, const glm::dvec3& v) {
    return std::abs(v.x) <= most && std::abs(v.y) <= most && std::abs(v.z) <= most;
}

double sum_of_sizes(const Rows& m) {
    const glm::dvec3 sizes = glm::abs(m.x) + glm::abs(m.y);
    return sizes.x + sizes.y + sizes.z;
}

void project_shape(const Splat& splat, const Camera& camera, ProjectionSteps& s) {
    const double z = s.view.z;
    s.slope.x = clamp_slope(s.view.x / z, camera.fx, camera.cx, camera.width, s.slope_free.x);
    s.slope.y = clamp_slope(s.view.y / z, camera.fy, camera.cy, camera.height, s.slope_free.y);
    const Rows& jacobian = s.image.jacobian;

    s.quaternion_norm = robust_norm(splat.quaternion);
    for (int k = 0; k < 4; ++k) s.unit_quaternion[k] = splat.quaternion[k] / s.quaternion_norm;
    s.rotation = rotation_matrix(s.unit_quaternion);
    s.scale = {std::exp(splat.log_scale.x), std::exp(splat.log_scale.y), std::exp(splat.log_scale.z)};

    // In glm, vector * matrix is a row vector times a matrix.
    s.screen = {jacobian.x * s.camera_rotation, jacobian.y * s.camera_rotation};
    s.m = {(s.screen.x * s.rotation) * s.scale, (s.screen.y * s.rotation) * s.scale};
}

/// |J| of the ray-space transform.
double ray_space_factor(const ProjectionSteps& s) {
    return glm::length(glm::cross(s.image.jacobian.x, s.image.jacobian.y));
}

double low_pass_of(Footprint kernel) {
    return kernel == Footprint::antialias ? LOW_PASS_ANTIALIAS : LOW_PASS;
}

double kernel_factor(Footprint kernel, const ProjectionSteps& s, double det) {
    switch (kernel) {
        case Footprint::peak:
            return 1;
        case Footprint::antialias:
            return std::sqrt(std::max(0.0, s.det0 / det));
        case Footprint::density:
            return mean_shadow(s.scale) * ray_space_factor(s) / std::sqrt(det);
    }
    return 0;
}

/// Where the camera sees the mean.
void see(const glm::dvec3& mean, const Camera& camera, ProjectionSteps& s) {
    if (scene::moves(camera)) {
        s.readout = readout_image(camera, mean, s.image);
        s.camera_rotation = s.readout.camera.rotation;
        s.offset = mean - s.readout.camera.position();
        s.view = s.readout.point;
        return;
    }
    s.camera_rotation = camera.rotation;
    s.view = camera.rotation * s.offset;
    s.image = lens_image(camera, s.view);
}

void evaluate_color(const Splat& splat, const Camera& camera, const RenderOptions& options,
                    ProjectionSteps& s) {
    s.sh_degree = std::clamp(options.sh_degree, 0, splat.sh_degree);
    s.parallel = camera.distortion.lens == Lens::orthographic;
    s.direction =
        s.parallel ? glm::transpose(s.camera_rotation) * glm::dvec3(0, 0, 1) : glm::normalize(s.offset);
    const auto basis = sh_basis(s.sh_degree, s.direction);
    s.raw_color = glm::dvec3(COLOR_OFFSET);
    for (int j = 0; j < sh_coefficients(s.sh_degree); ++j) s.raw_color += basis[j] * splat.sh[j];
}

}  // namespace

Projected project(const Splat& splat, const Camera& camera, const RenderOptions& options,
                  ProjectionSteps* steps) {
    Projected out;
    if (!stored_values_usable(splat)) {
        out.skipped_nonfinite = true;
        return out;
    }
    ProjectionSteps s;
    s.offset = splat.mean - camera.position();
    if (!within(VIEW_MAX, s.offset)) {
        out.skipped_nonfinite = true;
        return out;
    }
    see(splat.mean, camera, s);
    out.z = s.image.depth;
    if (!s.image.shown) return out;

    out.mean2d = s.image.pixel;
    if (scene::shows_all_around(camera)) out.around = camera.width;
    project_shape(splat, camera, s);
    evaluate_color(splat, camera, options, s);
    if (!(sum_of_sizes(s.m) <= FOOTPRINT_MAX) || !within(COLOR_MAX, s.raw_color - COLOR_OFFSET)) {
        out.skipped_nonfinite = true;
        return out;
    }
    const double low_pass = low_pass_of(options.kernel);
    out.a = glm::dot(s.m.x, s.m.x) + low_pass;
    out.b = glm::dot(s.m.x, s.m.y);
    out.c = glm::dot(s.m.y, s.m.y) + low_pass;
    const glm::dvec3 minors = glm::cross(s.m.x, s.m.y);
    s.det0 = glm::dot(minors, minors);
    const double trace = glm::dot(s.m.x, s.m.x) + glm::dot(s.m.y, s.m.y);
    out.det = s.det0 + low_pass * trace + low_pass * low_pass;

    s.sigmoid = 1 / (1 + std::exp(-splat.opacity_logit));
    s.kernel_factor = kernel_factor(options.kernel, s, out.det);
    out.density = options.kernel == Footprint::density;
    s.peak = out.density ? softplus(splat.opacity_logit) : s.sigmoid;
    out.opacity = s.peak * s.kernel_factor;
    if (out.density) out.opacity = std::min(out.opacity, DEPTH_MAX);
    if (!(out.opacity >= raw_of(out, ALPHA_MIN))) return out;
    out.color = glm::max(s.raw_color, glm::dvec3(0));
    out.visible = true;
    if (steps) *steps = s;
    return out;
}

namespace {

/// dL/ddet0 and dL/dtrace given dL/dfactor, where det = det0 + low_pass * trace + low_pass^2.
struct DetGradient {
    double det0 = 0, trace = 0;
};

DetGradient kernel_backward(Footprint kernel, const ProjectionSteps& s, double det, double by_factor) {
    if (kernel == Footprint::peak) return {};
    const double by_det = -0.5 * s.kernel_factor / det;
    // Antialias is sqrt(det0 / det). det0 > 0, because otherwise the factor is zero and the splat invisible.
    const double direct = kernel == Footprint::antialias ? 0.5 / std::sqrt(s.det0 * det) : 0;
    return {by_factor * (direct + by_det), by_factor * by_det * low_pass_of(kernel)};
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

/// dL/dJ = dL/dM (W R S)^T, row by row.
Rows axes_gradient(const ProjectionSteps& s, const Rows& by_m) {
    const glm::dmat3 axes =
        s.camera_rotation *
        glm::dmat3(s.rotation[0] * s.scale[0], s.rotation[1] * s.scale[1], s.rotation[2] * s.scale[2]);
    return {axes * by_m.x, axes * by_m.y};
}

/// dL/d(view position) through mean2d and through J. by_log: dL/d ln(optical depth) of a density, whose |J| is
/// |row0 x row1|; else 0. by_offset: the colour's dL/d(mean - camera position), which counts here for the time of a readout.
/// by_motion: of readout_backward.
glm::dvec3 view_backward(const ProjectionSteps& s, const ScreenGradient& g, const Rows& by_m, double by_log,
                         const glm::dvec3& by_offset, glm::dvec3& by_motion) {
    const LensImage& image = s.image;
    glm::dvec3 by_view = g.mean2d.x * image.exact.x + g.mean2d.y * image.exact.y;
    Rows by_j = axes_gradient(s, by_m);
    // The camera's rotation turns the axes: that moves M as a turn of the rows the other way would.
    const double by_axes = s.readout.moves
                               ? glm::dot(s.readout.turn, glm::cross(by_j.x, image.jacobian.x) +
                                                              glm::cross(by_j.y, image.jacobian.y))
                               : 0;
    if (by_log != 0) {
        const glm::dvec3 n = glm::cross(image.jacobian.x, image.jacobian.y);
        by_j.x += by_log / glm::dot(n, n) * glm::cross(image.jacobian.y, n);
        by_j.y += by_log / glm::dot(n, n) * glm::cross(n, image.jacobian.x);
    }
    if (s.readout.moves) return readout_backward(s.readout, {by_j, by_view, by_axes, by_offset}, by_motion);
    for (size_t c = 0; c < 3; ++c)
        by_view += by_j.x[int(c)] * image.hessian[0][c] + by_j.y[int(c)] * image.hessian[1][c];
    return by_view;
}

/// Adds the gradient through A, given dL/d ln(optical depth).
void shadow_backward(const ProjectionSteps& s, double by_log, glm::dvec3& log_scale) {
    const glm::dvec3 pairs = pair_ratios(s.scale), squares = pairs * pairs;
    log_scale += by_log * (1.0 - squares / (squares.x + squares.y + squares.z));
}

/// Sets the coefficients' gradient and returns dL/d(direction), as if it were free.
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
    return by_direction;
}

/// dL/d(mean - camera position) through the direction.
glm::dvec3 direction_backward(const ProjectionSteps& s, const glm::dvec3& by_direction) {
    if (s.parallel) return glm::dvec3(0);
    return (by_direction - s.direction * glm::dot(s.direction, by_direction)) / glm::length(s.offset);
}

/// by_log: dL/d ln(optical depth) of a density, whose |J| has both focal lengths; else 0. Through another lens than a pinhole, the
/// bounds of tangents do not move with the focal lengths.
void add_motion_gradient(const ProjectionSteps& s, const Camera& camera, const ScreenGradient& g,
                         const Rows& by_m, double by_log, const glm::dvec3& by_view,
                         const glm::dvec3& by_mean, const glm::dvec3& by_direction, CameraMotion& out) {
    const auto [by_jx, by_jy] = axes_gradient(s, by_m);
    const glm::dvec3 &jx = s.image.jacobian.x, &jy = s.image.jacobian.y;
    out.rotation += glm::cross(s.view, by_view) + glm::cross(by_jx, jx) + glm::cross(by_jy, jy);
    // Parallel rays turn with the camera, and with them the direction of the colours.
    if (s.parallel) out.rotation += glm::cross(camera.rotation * by_direction, glm::dvec3(0, 0, 1));
    out.shift -= camera.rotation * by_mean;
    const glm::dvec2 from_center = s.image.pixel - glm::dvec2(camera.cx, camera.cy);
    out.log_focal +=
        g.mean2d.x * from_center.x + g.mean2d.y * from_center.y + glm::dot(by_jx, jx) + glm::dot(by_jy, jy);
    const double by_secant = by_log / (1 + glm::dot(s.slope, s.slope));
    out.log_focal += 2 * by_log;
    if (!camera.distortion.none()) return;
    const double fx = camera.fx / s.view.z, fy = camera.fy / s.view.z;
    if (!s.slope_free.x) out.log_focal += fx * s.slope.x * by_jx.z - by_secant * s.slope.x * s.slope.x;
    if (!s.slope_free.y) out.log_focal += fy * s.slope.y * by_jy.z - by_secant * s.slope.y * s.slope.y;
}

}  // namespace

Splat project_backward(const Splat& splat, const Camera& camera, const RenderOptions& options,
                       const ScreenGradient& by_screen, CameraMotion* by_motion) {
    Splat out;
    out.sh_degree = splat.sh_degree;
    ProjectionSteps s;
    const Projected projected = project(splat, camera, options, &s);
    if (!projected.visible) return out;
    ScreenGradient gradient = by_screen;
    if (projected.density && s.peak * s.kernel_factor > DEPTH_MAX) gradient.opacity = 0;

    const DetGradient by_det = kernel_backward(options.kernel, s, projected.det, gradient.opacity * s.peak);
    const Rows by_m = m_gradient(s, gradient, by_det);
    shape_backward(s, by_m, out);
    const double by_logit = projected.density ? s.sigmoid : s.sigmoid * (1 - s.sigmoid);
    out.opacity_logit = gradient.opacity * s.kernel_factor * by_logit;
    const glm::dvec3 by_direction = color_backward(splat, s, gradient.color, out);
    const double by_log = projected.density ? gradient.opacity * projected.opacity : 0;
    const glm::dvec3 by_offset = direction_backward(s, by_direction);
    glm::dvec3 by_velocity(0);
    glm::dvec3 by_view = view_backward(s, gradient, by_m, by_log, by_offset, by_velocity);
    by_view.z += gradient.z;
    if (projected.density) shadow_backward(s, by_log, out.log_scale);
    out.mean = glm::transpose(s.camera_rotation) * by_view + by_offset;
    if (by_motion && s.readout.moves) {
        const auto [by_jx, by_jy] = axes_gradient(s, by_m);
        add_rolling_gradient(s.readout, camera, by_view, by_velocity,
                             glm::cross(by_jx, s.image.jacobian.x) + glm::cross(by_jy, s.image.jacobian.y),
                             out.mean, *by_motion);
    } else if (by_motion)
        add_motion_gradient(s, camera, gradient, by_m, by_log, by_view, out.mean, by_direction, *by_motion);
    return out;
}

}  // namespace ewa::reference
