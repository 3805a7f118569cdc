// SPDX-License-Identifier: Apache-2.0
// Figures that describe a splat scene at a glance.
#pragma once
#include <array>
#include <cstddef>
#include <string>

#include "ewa/gaussians.h"

namespace ewa::cli {

inline constexpr int kHistogramBins = 24;

/// Of the finite values; zeros where there is none.
struct Spread {
    double min = 0, median = 0, max = 0;
    std::array<size_t, kHistogramBins> histogram{};  // even bins from min to max, of the logarithm for scales
};

struct SplatStatistics {
    std::array<double, 3> low{}, high{};  // of the finite means, world units
    Spread opacity;                       // after the sigmoid
    Spread scale;                         // standard deviations, world units, all three axes
    size_t nonfinite = 0;                 // splats with a value that is not finite or a zero quaternion
};

SplatStatistics splat_statistics(const Gaussians& gaussians);

/// One character a bin, from a space over "." to "@".
std::string histogram_text(const Spread& spread);

}  // namespace ewa::cli
