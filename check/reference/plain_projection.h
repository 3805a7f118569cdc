// SPDX-License-Identifier: Apache-2.0
// The projection of the operators: of splats with linear scales or covariances, in views whose matrix need not be a rotation.
//
// With p = R mean + t, J as in reference/projection.h or reference/lens.h and T = J R, the 2D covariance is Sigma2 = T Sigma T^T + low_pass I, with
// Sigma = (Q S)(Q S)^T of quaternion and scales.
//   conic        = Sigma2^-1 = [a b; b c]^-1
//   whitener     = (ux, k, vy) = (sqrt(c / (2 det(Sigma2))), b / c, sqrt(1 / (2 c)))
//   compensation = sqrt(det(T Sigma T^T) / det(Sigma2))
//   radius       = ceil(s sqrt(diagonal of Sigma2)), s = min(3.33, sqrt(2 ln(255 opacity)))
// The gradient, with K the conic and V its gradient as symmetric matrices:
//   dL/dSigma2 = -K V K, plus the compensation's share;  dL/dSigma = T^T dL/dSigma2 T;  dL/dT = 2 dL/dSigma2 T Sigma
//   dL/d(Q S) = 2 dL/dSigma Q S
#pragma once
#include <array>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "ewa/camera.h"

namespace ewa::reference {

struct PlainSplat {
    glm::dvec3 mean{0};
    std::array<double, 4> quaternion{};  // w x y z
    glm::dvec3 scale{0};
    bool has_covariance = false;
    std::array<double, 6> covariance{};  // xx xy xz yy yz zz, in place of quaternion and scale
    std::optional<double> opacity;
};

struct PlainView {
    glm::dmat3 rotation{1};  // any matrix
    glm::dvec3 translation{0};
    glm::dvec2 focal{1}, center{0};  // px
    Distortion lens{};               // reference/lens.h has its J; none: a pinhole
};

/// As ewa::ProjectionOptions.
struct PlainOptions {
    uint32_t width = 0, height = 0;
    double low_pass = 0.3, near = 0.01, far = 1e10, radius_clip = 0;
    bool compensations = false, whiteners = false;
};

struct PlainProjected {
    bool visible = false;
    /// The other members are set in front of the camera too if the splat is not visible.
    glm::dvec2 reach{0};  // px; the radii are their ceilings
    glm::dvec2 mean2d{0};
    double depth = 0;
    glm::dvec3 conic{0};  // or whitener
    double compensation = 0;
};

PlainProjected project(const PlainSplat& splat, const PlainView& view, const PlainOptions& options);

/// dL/d(output). The conic's xy counts both of its places.
struct PlainScreenGradient {
    glm::dvec2 mean2d{0};
    double depth = 0;
    glm::dvec3 conic{0};
    double compensation = 0;
};

/// dL/d(input); the view's entries are independent.
struct PlainGradient {
    PlainSplat splat;
    glm::dmat3 rotation{0};
    glm::dvec3 translation{0};
};

/// The gradient of a splat that is visible.
PlainGradient project_backward(const PlainSplat& splat, const PlainView& view, const PlainOptions& options,
                               const PlainScreenGradient& gradient);

}  // namespace ewa::reference
