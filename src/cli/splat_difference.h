// SPDX-License-Identifier: Apache-2.0
// How far two splat scenes of the same length and order are apart.
#pragma once
#include <array>
#include <string>

#include "ewa/gaussians.h"
#include "report/summary.h"

namespace ewa::cli {

struct Difference {
    std::string what, unit;
    double largest = 0,
           mean = 0;  // of the magnitudes; a pair that is not finite on both sides counts as equal
};

/// Of means (world units), scales (natural logarithm), rotations (degrees), opacities and colours (0..1), and
/// SH coefficients above degree 0, where what one scene has not counts as zero. Throws RunError where the
/// lengths differ.
std::array<Difference, 6> differences(const Gaussians& a, const Gaussians& b);

}  // namespace ewa::cli
