// SPDX-License-Identifier: Apache-2.0
// A photograph as the loss reads it.
#pragma once
#include <cstdint>

#include "ewa/image.h"
#include "gpu/buffer.h"

namespace ewa::pipeline {

/// width * height RGBA texels: 8 bit where every value is one of 256 levels, or is to be rounded to one, else
/// float32. A picture of 3 channels is opaque; what alpha means is for record_loss to say.
gpu::Buffer upload_photo(gpu::Device& device, const Image& image, bool round_to_8_bit = false);

/// At most what upload_photo takes.
uint64_t photo_bytes(int width, int height, bool round_to_8_bit);

}  // namespace ewa::pipeline
