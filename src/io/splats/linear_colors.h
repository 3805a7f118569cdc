// SPDX-License-Identifier: Apache-2.0
// Scenes whose colours are in linear light.
#pragma once
#include <string>

#include "ewa/gaussians.h"

namespace ewa::io {

/// Converts colours from linear light to sRGB: the base colour exactly, view dependence by the slope of sRGB's curve at the
/// base colour. Returns a line for the user about this.
std::string linear_colors_to_srgb(Gaussians& gaussians);

}  // namespace ewa::io
