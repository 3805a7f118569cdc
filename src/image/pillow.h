// SPDX-License-Identifier: Apache-2.0
// The resizing of Python's Pillow, by which many evaluations make their images.
#pragma once
#include "ewa/image.h"

namespace ewa::image {

/// As Image.resize of Pillow 2.7 or later, for 8-bit images: bicubic, with filters that widen where the image shrinks, and
/// values that are rounded to 8 bits after each direction. image: multiples of 1/255.
Image resized_as_pillow(const Image& image, int width, int height);

}  // namespace ewa::image
