// SPDX-License-Identifier: Apache-2.0
#include "scene/opacity_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "ewa/splat_edit.h"

namespace ewa {
namespace scene {
namespace {

// Below it, softplus(x) is exp(x), and its square nothing beside it, in float64.
constexpr float kFarBelow = -40;

double softplus(double x) {
    return std::max(x, 0.0) + std::log1p(std::exp(-std::abs(x)));
}

float logit_of_softplus(double depth) {
    const double logit = depth + std::log(-std::expm1(-depth));
    return float(std::min(logit, double(std::numeric_limits<float>::max())));
}

bool stays(float logit) {
    return !std::isfinite(logit) || logit < kFarBelow;
}

}  // namespace

float shown_logit(float density_logit) {
    if (stays(density_logit)) return density_logit;
    const double depth = softplus(density_logit);
    return logit_of_softplus(depth + depth * depth / 4);
}

float density_logit(float shown_logit) {
    if (stays(shown_logit)) return shown_logit;
    const double depth = softplus(shown_logit);
    return logit_of_softplus(2 * depth / (1 + std::sqrt(1 + depth)));
}

}  // namespace scene

void fit_opacities(Gaussians& gaussians, bool density) {
    check(gaussians);
    if (gaussians.density == density) return;
    for (float& logit : gaussians.opacity_logits)
        logit = density ? scene::density_logit(logit) : scene::shown_logit(logit);
    gaussians.density = density;
}

}  // namespace ewa
