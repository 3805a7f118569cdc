// SPDX-License-Identifier: Apache-2.0
// A photograph's exposure (include/ewa/exposure.h), and the gradient through it:
//   c' = M c + b:   dL/dc = M^T dL/dc',   dL/dM = sum over pixels of dL/dc' c^T,   dL/db = sum of dL/dc'
#pragma once
#include <array>

#include "reference/values.h"

namespace ewa::reference {

/// Three rows of (matrix row, offset).
using Exposure = std::array<double, 12>;

/// RGB.
Raster exposed(const Raster& picture, const Exposure& exposure);

struct ExposureGradient {
    Raster picture;       // dL/d(picture)
    Exposure exposure{};  // dL/d(exposure)
};
/// picture: as it was before the exposure; gradient: dL/d(exposed picture).
ExposureGradient exposed_backward(const Raster& picture, const Exposure& exposure, const Raster& gradient);

}  // namespace ewa::reference
