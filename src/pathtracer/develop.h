// SPDX-License-Identifier: Apache-2.0
// From radiance to the numbers of a photograph.
#pragma once
#include <vector>

#include "ewa/image.h"

namespace ewa::pathtracer {

/// sRGB's curve (IEC 61966-2-1) over min(1, value); NaN and what is negative become 0.
float developed(double value);

/// RGBA of radiance times coverage and coverage, as RGB or, where the coverage is not whole everywhere, RGBA
/// with colour not multiplied by alpha; radiance times `factor`, developed.
Image develop(const Image& radiance, double factor);

/// Stops, in tenths, that bring the 95th percentile of the surfaces' brightest channel to 0.8; 0 where all is
/// black.
double automatic_exposure(const std::vector<Image>& radiances);

}  // namespace ewa::pathtracer
