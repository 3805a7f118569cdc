// SPDX-License-Identifier: Apache-2.0
// The training photographs and their cameras, for the device.
#pragma once
#include <future>
#include <vector>

#include "ewa/dataset.h"
#include "gpu/buffer.h"
#include "passes/kernel_config.h"
#include "pipeline/forward.h"

namespace ewa::train {

/// Holds decoded photographs on the device up to a number of bytes: the first frames that fit. The others
/// stay on disk and are read again each time; which ones are held changes no result. Beside the cache there
/// is one photograph on the device and one being read.
class Photographs {
  public:
    /// Loads and uploads the pictures that are held, their sides divided by `reduction`. origin: of the model
    /// that the cameras look at. Throws InputError that names the frame.
    Photographs(gpu::Device& device, const passes::KernelConfig& config, const Dataset& dataset,
                const std::vector<int>& frames, uint64_t cache_bytes, const glm::dvec3& origin,
                int reduction = 1);

    size_t count() const { return photos_.size(); }
    size_t on_disk() const { return on_disk_; }

    /// A photograph as the loss takes it, valid until the next call.
    struct Photo {
        const gpu::Buffer& texels;
        bool masked;  // its alpha says how much each pixel counts, and some count less
    };
    /// Reads it where it is not held. The device must be idle. Throws InputError.
    Photo photo(size_t i);
    /// Starts reading photograph i in the background where it is not held, for the next call of photo.
    void prepare(size_t i);

    /// Whether a photograph may be masked.
    bool any_masked() const { return any_masked_; }
    pipeline::CameraUse camera(size_t i) const;

  private:
    struct Held {
        gpu::Buffer texels;  // empty: on disk
        bool masked = false;
    };
    Held upload(const Frame& frame, const Image& image) const;

    gpu::Device& device_;
    std::vector<Frame> frames_;
    std::vector<Held> photos_;
    size_t on_disk_ = 0;
    bool any_masked_ = false;
    Held visitor_;  // the last one from disk
    size_t coming_ = 0;
    std::future<Image> reading_;
    gpu::Buffer cameras_;
    uint64_t camera_stride_ = 0;
};

/// The frame of a step (from 1): each photograph once an epoch, every epoch in an order of its own, a pure
/// function of the seed.
size_t frame_of_step(int step, size_t count, uint64_t seed);

}  // namespace ewa::train
