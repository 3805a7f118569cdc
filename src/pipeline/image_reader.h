// SPDX-License-Identifier: Apache-2.0
// Reads a frame's image planes back to the host.
#pragma once
#include <vector>

#include "ewa/image.h"
#include "pipeline/frame_buffers.h"

namespace ewa::pipeline {

/// The planes of a frame that is done, read back from the device.
class ImageReader {
  public:
    explicit ImageReader(const FrameBuffers& frame)
        : sizes_(frame.sizes), planes_(frame.planes.download<float>(frame.sizes.planes / 4)) {}
    /// An image whose channels are `count` planes from `first` on (shared::PLANE_*).
    Image image(uint32_t first, int count) const;

  private:
    const Sizes& sizes_;
    std::vector<float> planes_;
};

}  // namespace ewa::pipeline
