// SPDX-License-Identifier: Apache-2.0
// Figures of a splat scene, and the largest differences between two.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "ewa/gaussians.h"

namespace ewa::cli {

/// Figures of the finite values; zeros if there are none.
struct Spread {
    double min = 0, median = 0, max = 0;
};

struct SplatStatistics {
    std::array<double, 3> low{}, high{};  // bounds of the finite means, world units
    Spread opacity;                       // after the sigmoid
    Spread scale;                         // standard deviations, world units, all three axes
    size_t nonfinite = 0;                 // splats with a value that is not finite or a zero quaternion
};

SplatStatistics splat_statistics(const Gaussians& gaussians);

/// The line about splats that a command could not draw. skipped: their number. why: undrawable_text() of the scene.
std::string skipped_text(uint64_t skipped, const std::string& why);

struct Difference {
    std::string what, unit;
    // Differences of the magnitudes. Two values that are both not finite count as equal.
    double largest = 0, mean = 0;
};

/// Differences of means (world units), scales (natural logarithm), rotations (degrees), opacities, colours
/// (0..1) and SH coefficients above degree 0; coefficients that one scene lacks count as zero. The scenes
/// have the same order. Throws RunError if their sizes differ.
std::array<Difference, 6> differences(const Gaussians& a, const Gaussians& b);

}  // namespace ewa::cli
