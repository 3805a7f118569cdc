// SPDX-License-Identifier: Apache-2.0
#include "reference/projection.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numbers>

#include "reference/spherical_harmonics.h"
#include "shared/constants.h"

namespace ewa::reference {

using namespace shared;

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

namespace {

bool stored_values_usable(const Splat& splat) {
    for (int k = 0; k < 3; ++k)
        if (!std::isfinite(splat.mean[k]) || !std::isfinite(splat.log_scale[k])) return false;
    for (double v : splat.quaternion)
        if (!std::isfinite(v)) return false;
    return std::isfinite(splat.opacity_logit) && robust_norm(splat.quaternion) >= QUATERNION_MIN;
}

/// Phrased so that NaN fails it.
bool within(double most, const glm::dvec3& v) {
    return std::abs(v.x) <= most && std::abs(v.y) <= most && std::abs(v.z) <= most;
}

double sum_of_sizes(const Rows& m) {
    const glm::dvec3 sizes = glm::abs(m.x) + glm::abs(m.y);
    return sizes.x + sizes.y + sizes.z;
}

/// x/z (or y/z) moved into the picture's span plus a margin of JACOBIAN_MARGIN half pictures on either side,
/// measured from the principal point (gsplat, Utils.cuh, persp_proj).
double clamp_slope(double slope, double focal, double principal, int size, bool& free) {
    const double margin = JACOBIAN_MARGIN * size / (2 * focal);
    const double low = -(principal / focal + margin);
    const double high = (size - principal) / focal + margin;
    free = slope >= low && slope <= high;
    return std::clamp(slope, low, high);
}

void project_shape(const Splat& splat, const Camera& camera, ProjectionSteps& s) {
    const double z = s.view.z;
    s.slope.x = clamp_slope(s.view.x / z, camera.fx, camera.cx, camera.width, s.slope_free.x);
    s.slope.y = clamp_slope(s.view.y / z, camera.fy, camera.cy, camera.height, s.slope_free.y);
    const Rows jacobian{{camera.fx / z, 0, -camera.fx * s.slope.x / z},
                        {0, camera.fy / z, -camera.fy * s.slope.y / z}};

    s.quaternion_norm = robust_norm(splat.quaternion);
    for (int k = 0; k < 4; ++k) s.unit_quaternion[k] = splat.quaternion[k] / s.quaternion_norm;
    s.rotation = rotation_matrix(s.unit_quaternion);
    s.scale = {std::exp(splat.log_scale.x), std::exp(splat.log_scale.y), std::exp(splat.log_scale.z)};

    // A row vector times a matrix is vector * matrix in glm.
    s.screen = {jacobian.x * camera.rotation, jacobian.y * camera.rotation};
    s.m = {(s.screen.x * s.rotation) * s.scale, (s.screen.y * s.rotation) * s.scale};
}

double kernel_factor(Footprint kernel, double det0, double det) {
    switch (kernel) {
        case Footprint::peak:
            return 1;
        case Footprint::antialias:
            return std::sqrt(std::max(0.0, det0 / det));
        case Footprint::unit_mass:
            return 1 / (2 * std::numbers::pi * std::sqrt(det));
    }
    return 0;
}

void evaluate_color(const Splat& splat, const RenderOptions& options, ProjectionSteps& s) {
    s.sh_degree = std::clamp(options.sh_degree, 0, splat.sh_degree);
    s.direction = glm::normalize(s.offset);
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
    s.view = camera.rotation * s.offset;
    out.z = s.view.z;
    if (!(out.z > NEAR_PLANE)) return out;

    out.mean2d = {camera.fx * s.view.x / out.z + camera.cx, camera.fy * s.view.y / out.z + camera.cy};
    project_shape(splat, camera, s);
    evaluate_color(splat, options, s);
    if (!(sum_of_sizes(s.m) <= FOOTPRINT_MAX) || !within(COLOR_MAX, s.raw_color - COLOR_OFFSET)) {
        out.skipped_nonfinite = true;
        return out;
    }
    out.a = glm::dot(s.m.x, s.m.x) + LOW_PASS;
    out.b = glm::dot(s.m.x, s.m.y);
    out.c = glm::dot(s.m.y, s.m.y) + LOW_PASS;
    const glm::dvec3 minors = glm::cross(s.m.x, s.m.y);
    s.det0 = glm::dot(minors, minors);
    const double trace = glm::dot(s.m.x, s.m.x) + glm::dot(s.m.y, s.m.y);
    out.det = s.det0 + LOW_PASS * trace + LOW_PASS * LOW_PASS;

    s.sigmoid = 1 / (1 + std::exp(-splat.opacity_logit));
    s.kernel_factor = kernel_factor(options.kernel, s.det0, out.det);
    out.opacity = s.sigmoid * s.kernel_factor;
    if (!(out.opacity >= ALPHA_MIN)) return out;
    out.color = glm::max(s.raw_color, glm::dvec3(0));
    out.visible = true;
    if (steps) *steps = s;
    return out;
}

Projected project(const Gaussians& gaussians, size_t i, const Camera& camera, const RenderOptions& options) {
    return project(read_splat(gaussians, i), camera, options);
}

Projected project(const Values& values, size_t i, const Camera& camera, const RenderOptions& options) {
    return project(read_splat(values, i), camera, options);
}

}  // namespace ewa::reference
