// A PNG in memory, for embedding.
#pragma once
#include <vector>

#include "ewa/image.h"

namespace ewa::image {

/// The bytes of the file that save_image would write: 8 bit, rounded, clamped to [0, 1]. Throws RunError.
std::vector<unsigned char> encode_png(const Image& image);

}  // namespace ewa::image
