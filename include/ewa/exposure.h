// SPDX-License-Identifier: Apache-2.0
// The exposure of a training image.
#pragma once
#include <array>
#include <filesystem>
#include <map>
#include <string>

#include "ewa/image.h"

namespace ewa {

/// An affine map of colours: three rows of a 3x3 matrix M, each followed by its offset in b. The training
/// image shows M c + b where the splats have colour c.
using Exposure = std::array<float, 12>;
inline constexpr Exposure kIdentityExposure{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// Applies the exposure to the first three channels, without clamping. Other channels stay. Throws InputError for
/// fewer than 3 channels.
Image exposed(Image image, const Exposure& exposure);

/// The exposures of training images under their Frame::name: exposures.json of a run's folder. Throws InputError if the
/// file cannot be read, or an exposure is not three rows of four finite numbers.
std::map<std::string, Exposure> load_exposures(const std::filesystem::path& path);

}  // namespace ewa
