// SPDX-License-Identifier: Apache-2.0
#include "reference/footprint.h"

#include <algorithm>
#include <cmath>

#include "shared/constants.h"

namespace ewa::reference {

using namespace shared;

double alpha_floor(const Smoothing& smoothing) {
    return smoothing.cut == AlphaCut::none ? 1e-18 : ALPHA_MIN;
}

Alpha alpha_of(double raw, const Smoothing& smoothing) {
    Alpha alpha;
    if (!(raw >= alpha_floor(smoothing))) return alpha;
    alpha.kept = true;
    alpha.value = std::min(ALPHA_MAX, raw);
    alpha.slope = raw > ALPHA_MAX ? 0 : 1;
    if (smoothing.cut == AlphaCut::ramp) {
        const double t = std::clamp((raw - ALPHA_MIN) / ALPHA_MIN, 0.0, 1.0);
        const double step = t * t * (3 - 2 * t);
        const double step_slope = 6 * t * (1 - t) / ALPHA_MIN;
        alpha.slope = alpha.slope * step + alpha.value * step_slope;
        alpha.value *= step;
    }
    return alpha;
}

Whitener whitener(const Projected& splat) {
    const double root = std::sqrt(splat.c) * std::sqrt(splat.det);
    return {splat.c / root, -splat.b / root, 1 / std::sqrt(splat.c)};
}

Sample sample(const Projected& splat, const Whitener& w, const glm::dvec2& pixel) {
    const glm::dvec2 d = pixel - splat.mean2d;
    Sample s;
    s.u = w.ux * d.x + w.uy * d.y;
    s.v = w.vy * d.y;
    s.raw = splat.opacity * std::exp(-0.5 * (s.u * s.u + s.v * s.v));
    return s;
}

}  // namespace ewa::reference
