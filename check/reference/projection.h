// SPDX-License-Identifier: Apache-2.0
// The projection of a splat to an image: position, footprint, opacity and colour.
//
// The pinhole projects the mean, and its linearisation at the mean projects the covariance (Zwicker et al.
// 2001, "EWA Splatting", eq. 31; Kerbl et al. 2023, "3D Gaussian Splatting", eq. 5 and 6):
//   p          = W (mean - camera position)                   view coordinates
//   mean2d     = (fx p.x / p.z + cx, fy p.y / p.z + cy)       px, not clamped
//   J          = [fx/z 0 -fx tx/z; 0 fy/z -fy ty/z]           tx = clamp(p.x / z), ty = clamp(p.y / z)
// Other lenses: mean2d and J are those of reference/lens.h. Through a rolling shutter, p, W and J are those of reference/readout.h.
//   M          = J W R S                                      2 x 3; R: unit quaternion, S: exp(log scale)
//   [a b; b c] = M M^T + LOW_PASS * I                         px^2
//   det0       = det(M M^T) = |row0 x row1|^2                 Cauchy-Binet: squared 2 x 2 minors of M
//   det        = det0 + LOW_PASS * trace(M M^T) + LOW_PASS^2  avoids the cancellation of a c - b^2
// With Footprint::antialias, LOW_PASS_ANTIALIAS takes the place of LOW_PASS.
// Opacity is sigmoid(logit) times the kernel's factor (KERNEL_* in shared/constants.h):
//   peak 1;  antialias sqrt(max(0, det0 / det))
// With Footprint::density the splat is a density in space, and the optical depth takes the place of the opacity:
//   depth = softplus(logit) A |J| / sqrt(det),  A = sqrt(((s1 s2)^2 + (s2 s3)^2 + (s3 s1)^2) / 3)
//   |J|   = |row0 x row1| of J = fx fy sqrt(1 + tx^2 + ty^2) / z^2     of the ray-space transform; depth is at most DEPTH_MAX
// Colour is max(0, COLOR_OFFSET + sum_j sh_j Y_j(direction)), direction = normalise(mean - camera position), or the camera's axis
// where the lens is orthographic.
#pragma once
#include <array>
#include <cstddef>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "ewa/camera.h"
#include "ewa/camera_motion.h"
#include "ewa/render_options.h"
#include "reference/lens.h"
#include "reference/readout.h"
#include "reference/values.h"
#include "scene/color.h"

namespace ewa::reference {

using scene::sh_basis;

/// If neither flag is set, the splat is culled: z is not above NEAR_PLANE, the lens does not show the mean, or the opacity is
/// below ALPHA_MIN.
/// The other members are valid for a visible splat.
struct Projected {
    bool visible = false;
    /// Set for a mean, quaternion, log scale or opacity that is not finite, a quaternion below
    /// QUATERNION_MIN, or a mean beyond VIEW_MAX. In front of the camera, also for a footprint beyond
    /// FOOTPRINT_MAX, or a colour beyond COLOR_MAX or not finite.
    bool skipped_nonfinite = false;
    double z = 0;                // view depth, or the distance where the lens orders by it; world units
    glm::dvec2 mean2d{0};        // px from the image's top left corner
    double a = 0, b = 0, c = 0;  // covariance with the low-pass, px^2
    double det = 0;              // of that covariance
    double opacity = 0;          // peak of the footprint, before the clamp to ALPHA_MAX
    double around =
        0;  // px from the splat to its next image, where the lens shows all around the camera; else 0
    bool density = false;  // Footprint::density: `opacity` is the peak of the optical depth
    glm::dvec3 color{0};
};

/// The value of Projected::opacity's unit that this opacity corresponds to.
double raw_of(const Projected& splat, double opacity);

/// ln(1 + exp(x)).
double softplus(double x);

/// The root mean square over all directions of a splat's shadow, the product of its two standard deviations.
double mean_shadow(const glm::dvec3& scale);

/// Intermediate values for the backward pass.
struct ProjectionSteps {
    glm::dvec3 offset{0};  // mean - camera position
    glm::dvec3 view{0};    // p
    LensImage image;
    ReadoutImage readout;
    glm::dmat3 camera_rotation{1};  // W
    glm::dvec2 slope{0};            // (tx, ty); of a pinhole, as the next
    glm::bvec2 slope_free{true};    // the clamp did not move it
    double quaternion_norm = 0;
    std::array<double, 4> unit_quaternion{};
    glm::dmat3 rotation{1};  // R
    glm::dvec3 scale{0};     // diagonal of S
    Rows screen;             // J W
    Rows m;                  // M
    double det0 = 0;
    double sigmoid = 0;  // of the logit
    double peak = 0;     // that, or with Footprint::density softplus of the logit
    double kernel_factor = 0;
    int sh_degree = 0;      // the lower of the request's and the scene's
    bool parallel = false;  // every point is seen along the camera's axis
    glm::dvec3 direction{0};
    glm::dvec3 raw_color{0};  // before the max
};

/// Projects a splat. steps: receives the intermediate values if the splat is visible; may be null.
Projected project(const Splat& splat, const Camera& camera, const RenderOptions& options,
                  ProjectionSteps* steps = nullptr);
/// Projects splat i of Gaussians or Values.
template <class Scene>
Projected project(const Scene& scene, size_t i, const Camera& camera, const RenderOptions& options) {
    return project(read_splat(scene, i), camera, options);
}

/// The rotation matrix of a quaternion (w x y z) of unit norm. Its columns are the rotated axes.
glm::dmat3 rotation_matrix(const std::array<double, 4>& unit_quaternion);

/// dL/d(unit quaternion) from dL/d(rotation_matrix).
std::array<double, 4> rotation_backward(const std::array<double, 4>& unit_quaternion,
                                        const glm::dmat3& gradient);

/// Clamps x/z or y/z to the image with a margin of JACOBIAN_MARGIN half images on each side, relative to the
/// principal point (gsplat, Utils.cuh, persp_proj). free: whether the clamp did not move it.
double clamp_slope(double slope, double focal, double principal, int size, bool& free);

/// Euclidean norm without overflow or underflow of the squares.
double robust_norm(const std::array<double, 4>& quaternion);

/// dL/d(output of the projection of a splat). b occurs twice in the symmetric covariance, and its gradient
/// counts both: moving b by e changes L by gradient.b * e. As a symmetric matrix, dL/dSigma = [a b/2; b/2 c].
struct ScreenGradient {
    glm::dvec2 mean2d{0};
    double a = 0, b = 0, c = 0;
    double opacity = 0;
    glm::dvec3 color{0};
    double z = 0;
    glm::dvec2 absolute{0};  // sum over pixels of |dL/dmean2d|, by component (Ye et al. 2024, AbsGS, eq. 7)
};

// The backward pass of the projection, with G = dL/dSigma as a symmetric matrix:
//   dL/dM  = 2 G M, plus the kernel factor's share through det0 and det:
//            ddet0/drow0 = 2 row1 x n, ddet0/drow1 = 2 n x row0 with n = row0 x row1; dtrace/dM = 2 M
//   with Footprint::density also d ln A / d log s_k = 1 - (A_k / A)^2 / 3, A_k the product of the other scales, A^2 the mean of A_k^2,
//            d ln|J| / dz = -2 / z and d ln|J| / dtx = tx / (1 + tx^2 + ty^2), without a gradient where tx or ty is clamped
//   dL/dJ  = dL/dM (W R S)^T;  dL/d(R S) = (J W)^T dL/dM
//   dL/dlog s_k = s_k sum_i R_ik dL/d(R S)_ik
//   dL/dq  = (I - q^ q^T) dL/dq^ / |q|, q^ = q / |q|
// The mean moves mean2d, J (unless tx or ty is clamped) and the direction of the colour.
// A channel of the colour that max(0, .) clamps to zero has no gradient.

/// dL/d(stored value). Zero for an invisible splat, and for coefficients above the degree in use.
/// by_motion: adds dL/d(each value of the camera's motion), for no motion.
//  With the columns W_j of W, dL/dw = p x dL/dp + sum_j W_j x dL/dW_j and dL/ds = -W dL/dmean. Both focal lengths move
//  mean2d - centre and M in proportion, and a slope that is clamped in inverse proportion.
Splat project_backward(const Splat& splat, const Camera& camera, const RenderOptions& options,
                       const ScreenGradient& gradient, CameraMotion* by_motion = nullptr);

/// dY_j/d(x, y, z) of the polynomials in scene/color.h, with independent x, y and z. The caller's
/// normalisation removes the part along the direction.
std::array<glm::dvec3, kMaxCoefficients> sh_basis_gradient(int degree, const glm::dvec3& direction);

}  // namespace ewa::reference
