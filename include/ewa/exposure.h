// SPDX-License-Identifier: Apache-2.0
// A photograph's exposure.
#pragma once
#include <array>

#include "ewa/image.h"

namespace ewa {

/// An affine map of colours: three rows of a 3x3 matrix M, each followed by its offset in b. A photograph
/// shows M c + b where the splats have colour c.
using Exposure = std::array<float, 12>;
inline constexpr Exposure kIdentityExposure{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// A picture of 3 channels or more as a photograph with this exposure shows it, not clamped; other channels
/// stay.
Image exposed(Image picture, const Exposure& exposure);

}  // namespace ewa
