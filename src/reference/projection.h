// SPDX-License-Identifier: Apache-2.0
// One splat seen by one camera: where it lies in the picture, how far it reaches, how opaque and what colour
// it is.
//
// The mean goes through the pinhole; the covariance through the pinhole's linearisation at the mean (Zwicker
// et al. 2001, "EWA Splatting", eq. 31; Kerbl et al. 2023, "3D Gaussian Splatting", eq. 5 and 6):
//   p      = W (mean - camera position)                                 view coordinates
//   mean2d = (fx p.x / p.z + cx, fy p.y / p.z + cy)                     px, not clamped
//   J      = [fx/z 0 -fx tx/z; 0 fy/z -fy ty/z]                         tx = clamp(p.x / z), ty = clamp(p.y /
//   z) M      = J W R S                                                    2 x 3; R from the unit quaternion,
//   S = exp(log scale) [a b; b c] = M M^T + LOW_PASS * I                                   px^2 det0   =
//   det(M M^T) = |row0 x row1|^2                               Cauchy-Binet: the squared 2 x 2 minors of M
//   det    = det0 + LOW_PASS * trace(M M^T) + LOW_PASS^2                never the cancelling a c - b^2
// Opacity is sigmoid(logit) times the kernel's factor (KERNEL_* in shared/constants.h):
//   peak 1;  antialias sqrt(max(0, det0 / det));  unit mass 1 / (2 pi sqrt(det))
// Colour is max(0, COLOR_OFFSET + sum_j sh_j Y_j(direction)), direction = normalise(mean - camera position).
#pragma once
#include <cstddef>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "ewa/camera.h"
#include "ewa/render_options.h"
#include "reference/values.h"

namespace ewa::reference {

/// Neither flag set: culled, that is z not above NEAR_PLANE or opacity below ALPHA_MIN. Only a visible
/// splat's other members hold anything.
struct Projected {
    bool visible = false;
    /// A mean, quaternion, log scale or opacity that is not finite, a quaternion under QUATERNION_MIN, or a
    /// mean beyond VIEW_MAX, wherever the splat is. Also one in front of the camera whose footprint is beyond
    /// FOOTPRINT_MAX or whose colour is beyond COLOR_MAX or not finite.
    bool skipped_nonfinite = false;
    double z = 0;                // view depth, world units
    glm::dvec2 mean2d{0};        // px from the picture's top left corner
    double a = 0, b = 0, c = 0;  // covariance with the low-pass, px^2
    double det = 0;              // of that covariance
    double opacity = 0;          // peak of the footprint, before the clamp to ALPHA_MAX
    glm::dvec3 color{0};
};

/// A 2 x 3 matrix by rows.
struct Rows {
    glm::dvec3 x{0}, y{0};
};

/// What the way back through the projection needs again.
struct ProjectionSteps {
    glm::dvec3 offset{0};         // mean - camera position
    glm::dvec3 view{0};           // p
    glm::dvec2 slope{0};          // (tx, ty)
    glm::bvec2 slope_free{true};  // the clamp did not move it
    double quaternion_norm = 0;
    std::array<double, 4> unit_quaternion{};
    glm::dmat3 rotation{1};  // R
    glm::dvec3 scale{0};     // diagonal of S
    Rows screen;             // J W
    Rows m;                  // M
    double det0 = 0;
    double sigmoid = 0;  // of the logit
    double kernel_factor = 0;
    int sh_degree = 0;  // the lower of the request's and the scene's
    glm::dvec3 direction{0};
    glm::dvec3 raw_color{0};  // before the max
};

/// steps: filled in when given and the splat is visible.
Projected project(const Splat& splat, const Camera& camera, const RenderOptions& options,
                  ProjectionSteps* steps = nullptr);
Projected project(const Gaussians& gaussians, size_t i, const Camera& camera, const RenderOptions& options);
Projected project(const Values& values, size_t i, const Camera& camera, const RenderOptions& options);

/// Columns are the rotated axes; the quaternion (w x y z) has unit norm.
glm::dmat3 rotation_matrix(const std::array<double, 4>& unit_quaternion);

/// Euclidean norm without overflow or underflow of the squares.
double robust_norm(const std::array<double, 4>& quaternion);

}  // namespace ewa::reference
