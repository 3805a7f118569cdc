// SPDX-License-Identifier: Apache-2.0
// Splats as solids: each pixel shows the nearest splat (by its mean's depth) whose ellipse of ELLIPSOID_REACH
// standard deviations, low-pass included, it lies in, and whose opacity is at least ELLIPSOID_OPACITY. With d
// the distance in standard deviations: colour (ELLIPSOID_RIM + (1 - ELLIPSOID_RIM) sqrt(1 - (d / reach)^2)),
// a sphere lit from the eye.
#pragma once
#include <array>
#include <span>

#include "reference/footprint.h"
#include "reference/instances.h"
#include "reference/values.h"

namespace ewa::reference {

/// RGB, the background where no splat is.
Raster ellipsoids(std::span<const Projected> projected, const Instances& instances,
                  const std::array<float, 3>& background);

}  // namespace ewa::reference
