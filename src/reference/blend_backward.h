// SPDX-License-Identifier: Apache-2.0
// The way back through compositing: from dL/d(picture) to each splat's footprint and colour.
//
// With S the colour behind splat i (background included), S = C - sum_{j <= i} c_j alpha_j T_j:
//   dL/dc_i     = sum over pixels of dL/dC alpha_i T_i
//   dL/dalpha_i = dL/dC . (c_i T_i - S / (1 - alpha_i))        1 - alpha >= 1 - ALPHA_MAX
//   g           = dL/dpower = dL/dalpha alpha                  zero where alpha is clamped at ALPHA_MAX
// S comes from front-to-back prefixes; T is never undone by division.
//
// With w = (u, v)^T = L d (see footprint.h) the power -w.w/2 has
//   dpower/dmean2d = L^T w,  dpower/dSigma = L^T w w^T L / 2,  dpower/dopacity = 1 / opacity
// so that a splat's gradient needs only the moments of g over its pixels, and those add up over tiles:
//   dL/dmean2d = L^T (Su, Sv),  dL/dSigma = L^T [Suu Suv; Suv Svv] L / 2,  dL/dopacity = S0 / opacity
#pragma once
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "reference/blend.h"

namespace ewa::reference {

/// Sums over the pixels of one (splat, tile) instance.
struct Moments {
    double s0 = 0, su = 0, sv = 0, suu = 0, suv = 0, svv = 0;  // of g times 1, u, v, uu, uv, vv
    glm::dvec3 color{0};                                       // dL/dcolour
    glm::dvec2 absolute{0};                                    // |dL/dmean2d| of each pixel, by component
    Moments& operator+=(const Moments& other);
};

/// dL/d(what projection made of one splat). b is one value that stands twice in the symmetric covariance, and
/// its gradient counts both places: moving b by e changes L by gradient.b * e. As a symmetric matrix,
/// dL/dSigma = [a b/2; b/2 c].
struct ScreenGradient {
    glm::dvec2 mean2d{0};
    double a = 0, b = 0, c = 0;
    double opacity = 0;
    glm::dvec3 color{0};
    glm::dvec2 absolute{
        0};  // |dL/dmean2d| of each pixel, by component, summed (Ye et al. 2024, AbsGS, eq. 7)
};

ScreenGradient screen_gradient(const Projected& splat, const Moments& moments);

struct BlendGradients {
    std::vector<Moments> instances;      // one for each of instances.sorted
    std::vector<ScreenGradient> splats;  // one for each splat, its tiles added in ascending order
};

/// blended: what blend() made of the same arguments. picture_gradient: dL/dcolour of each pixel, RGB.
BlendGradients blend_backward(std::span<const Projected> projected, const Instances& instances,
                              const Blended& blended, const Raster& picture_gradient,
                              const Smoothing& smoothing = {});

}  // namespace ewa::reference
