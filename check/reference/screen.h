// SPDX-License-Identifier: Apache-2.0
// Blending of 2D Gaussians that come as arrays, with any number of channels, and its gradient: plain loops over all splats
// at every pixel. The reference of the operators in include/ewa/operators.h.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "reference/blend.h"

namespace ewa::reference {

/// Arrays as in ScreenSplats, or dL/d(each entry).
struct ScreenValues {
    std::vector<double> means2d, conics, opacities, features;
    std::vector<double> background;  // one a channel
    size_t channels = 3;
    bool whiteners = false;
    size_t size() const { return opacities.size(); }
};

struct ScreenImage {
    int width = 0, height = 0;
    std::vector<double> features;  // [H, W, D]
    std::vector<double> alphas;    // [H, W]
};

/// order: the splats of every pixel, front to back.
ScreenImage blend(const ScreenValues& splats, std::span<const uint32_t> order, int width, int height,
                  const Smoothing& smoothing = {});

struct ScreenValuesGradient {
    ScreenValues values;
    std::vector<double> absolute;  // [M, 2], sum over the pixels of |dL/d(mean)|
};

/// d(alpha_i) has two ways into the image: its own weight, and all that is behind it. With R_i = (what is behind splat i).
/// dL/dC, the transmittance of the pixel included:  dL/d(alpha_i) = T_i f_i . dL/dC - R_i / (1 - alpha_i).
/// features_gradient: [H, W, D]; alphas_gradient: [H, W].
ScreenValuesGradient blend_backward(const ScreenValues& splats, std::span<const uint32_t> order, int width,
                                    int height, std::span<const double> features_gradient,
                                    std::span<const double> alphas_gradient, const Smoothing& smoothing = {});

}  // namespace ewa::reference
