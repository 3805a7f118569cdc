// A photograph as the loss reads it.
#pragma once
#include "ewa/image.h"
#include "gpu/buffer.h"

namespace ewa::pipeline {

/// width * height RGBA texels: 8 bit where every value is one of 256 levels, else float32. A picture of 3
/// channels is opaque; transparency is composited over the step's background when the loss is taken.
gpu::Buffer upload_photo(gpu::Device& device, const Image& image);

}  // namespace ewa::pipeline
