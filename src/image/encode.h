// SPDX-License-Identifier: Apache-2.0
// Pictures as the bytes of a file, in memory: for saving in one piece and for embedding.
#pragma once
#include <vector>

#include "ewa/image.h"

namespace ewa::image {

/// 8 bit, rounded, clamped to [0, 1], NaN as 0. Throws RunError.
std::vector<unsigned char> encode_png(const Image& image);

/// float32, not clamped. Throws RunError.
std::vector<unsigned char> encode_exr(const Image& image);

}  // namespace ewa::image
