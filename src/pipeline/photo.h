// SPDX-License-Identifier: Apache-2.0
// A training image as the loss reads it.
#pragma once
#include <cstdint>

#include "ewa/image.h"
#include "gpu/buffer.h"

namespace ewa::pipeline {

/// width * height RGBA texels: 8-bit if every value is one of 256 levels, or with round_to_8_bit; else
/// float32. An image of 3 channels is opaque. record_loss says what alpha means.
gpu::Buffer upload_photo(gpu::Device& device, const Image& image, bool round_to_8_bit = false);

/// Upper bound of the bytes that upload_photo allocates.
uint64_t photo_bytes(int width, int height, bool round_to_8_bit);

}  // namespace ewa::pipeline
