// SPDX-License-Identifier: Apache-2.0
// The format of antimatter15's viewer: 32 bytes per splat, without a header:
//   byte 0    float32 x y z
//   byte 12   float32 scales, linear
//   byte 24   uint8 r g b, opacity
//   byte 28   uint8 quaternion w x y z, each component q as 128 q + 128
// rgb is the colour of SH coefficient 0, so there is no view dependence.
#pragma once
#include <filesystem>

#include "ewa/splat_scene.h"

namespace ewa::io {

/// Throws InputError if the size is not a multiple of 32.
SplatScene read_splat(const std::filesystem::path& path);

/// Writes the splats in the order of the scene. Throws RunError.
std::vector<std::string> write_splat(const std::filesystem::path& path, const Gaussians& gaussians,
                                     const SaveOptions& options);

}  // namespace ewa::io
