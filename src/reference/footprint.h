// SPDX-License-Identifier: Apache-2.0
// What one splat does to one pixel.
//
//   d = pixel centre - mean2d
//   u = (c d.x - b d.y) / sqrt(c det),  v = d.y / sqrt(c),  power = -(u^2 + v^2) / 2
//   raw alpha = opacity exp(power),  alpha = min(ALPHA_MAX, raw), nothing below ALPHA_MIN
//
// (u, v) = L d with L^T L the inverse covariance (its Cholesky factor), so the power equals the quadratic
// form of Kerbl et al. 2023, eq. 4, as a sum of squares that cannot cancel.
#pragma once
#include <glm/vec2.hpp>

#include "reference/projection.h"

namespace ewa::reference {

/// How alpha ends at ALPHA_MIN. The model's own cut makes a picture jump as a splat moves, which a central
/// difference cannot tell from a gradient; the other two are for such tests.
enum class AlphaCut {
    hard,  // nothing below ALPHA_MIN
    ramp,  // times a C1 step that rises from 0 at ALPHA_MIN to 1 at 2 ALPHA_MIN
    none,  // as far as 1e-18
};

struct Smoothing {
    AlphaCut cut = AlphaCut::hard;
    bool transmittance_stop = true;  // blending stops at TRANSMITTANCE_STOP
};

/// No contribution has a raw alpha below this.
double alpha_floor(const Smoothing& smoothing);

struct Alpha {
    bool kept = false;
    double value = 0;
    double slope = 0;  // d value / d raw: zero where the clamp to ALPHA_MAX is active
};
Alpha alpha_of(double raw, const Smoothing& smoothing);

/// L = [ux uy; 0 vy] of a covariance.
struct Whitener {
    double ux = 0, uy = 0, vy = 0;
};
Whitener whitener(const Projected& splat);

struct Sample {
    double u = 0, v = 0;
    double raw = 0;  // raw alpha
};
inline glm::dvec2 pixel_centre(int x, int y) {
    return {x + 0.5, y + 0.5};
}
Sample sample(const Projected& splat, const Whitener& whitener, const glm::dvec2& pixel);

}  // namespace ewa::reference
