// The training photographs and their cameras on the device.
#pragma once
#include <algorithm>
#include <vector>

#include "ewa/dataset.h"
#include "gpu/buffer.h"
#include "passes/shape.h"
#include "pipeline/forward.h"

namespace ewa::train {

class Photographs {
  public:
    /// Loads and uploads every frame's picture. Throws InputError that names the frame.
    Photographs(gpu::Device& device, const passes::Shape& shape, const Dataset& dataset,
                const std::vector<int>& frames);

    size_t count() const { return photos_.size(); }
    const gpu::Buffer& photo(size_t i) const { return photos_[i]; }
    /// Whether the photograph's alpha says how much each pixel counts, and some count less.
    bool masked(size_t i) const { return masked_[i]; }
    bool any_masked() const { return std::find(masked_.begin(), masked_.end(), true) != masked_.end(); }
    pipeline::CameraUse camera(size_t i) const;
    uint32_t max_width() const { return max_width_; }
    uint32_t max_height() const { return max_height_; }

  private:
    struct Size {
        uint32_t width, height;
    };
    std::vector<gpu::Buffer> photos_;
    std::vector<Size> sizes_;
    std::vector<bool> masked_;
    gpu::Buffer cameras_;
    uint64_t camera_stride_ = 0;
    uint32_t max_width_ = 0, max_height_ = 0;
};

/// The frame of a step (from 1): each photograph once an epoch, every epoch in an order of its own, a pure
/// function of the seed.
size_t frame_of_step(int step, size_t count, uint64_t seed);

}  // namespace ewa::train
