// SPDX-License-Identifier: Apache-2.0
// The 32 bytes a splat of antimatter15's viewer, without a header:
//   0 float32 x y z    12 float32 scales, linear    24 uint8 r g b, opacity    28 uint8 quaternion w x y z
// rgb is the colour of SH coefficient 0, so there is no view dependence; a quaternion's component q is 128 q
// + 128.
#pragma once
#include "ewa/splat_files.h"

namespace ewa::io {

/// Throws InputError where the size is no multiple of 32.
SplatScene read_splat(const std::filesystem::path& path);

/// In the order of the scene. Throws RunError.
std::vector<std::string> write_splat(const std::filesystem::path& path, const Gaussians& gaussians,
                                     const SaveOptions& options);

}  // namespace ewa::io
