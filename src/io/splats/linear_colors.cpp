// SPDX-License-Identifier: Apache-2.0
#include "io/splats/linear_colors.h"

#include <cmath>

#include "io/splats/splat_values.h"
#include "scene/color.h"

namespace ewa::io {

namespace {

/// sRGB's curve, mirrored for negative values, and its slope.
double signed_srgb(double v) {
    return std::copysign(scene::srgb_of_linear(std::abs(v)), v);
}
double srgb_slope(double v) {
    const double a = std::abs(v);
    return a <= 0.0031308 ? 12.92 : 1.055 / 2.4 * std::pow(a, 1 / 2.4 - 1);
}

}  // namespace

std::string linear_colors_to_srgb(Gaussians& gaussians) {
    for (size_t i = 0; i < gaussians.size(); ++i)
        for (size_t channel = 0; channel < 3; ++channel) {
            float* sh = &gaussians.sh[gaussians.sh_stride() * i + channel];
            const double color = color_of_sh0(sh[0]);
            sh[0] = float(sh0_of_color(signed_srgb(color)));
            for (size_t k = 3; k < gaussians.sh_stride(); k += 3) sh[k] = float(sh[k] * srgb_slope(color));
        }
    return "colours are in linear light and become sRGB values; splats that overlap blend in these" +
           std::string(gaussians.sh_degree > 0 ? ", and view dependence is taken to first order" : "");
}

}  // namespace ewa::io
