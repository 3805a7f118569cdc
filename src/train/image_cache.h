// SPDX-License-Identifier: Apache-2.0
// The training images and their cameras on the device.
#pragma once
#include <future>
#include <memory>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/loss_weights.h"
#include "ewa/train_options.h"
#include "gpu/buffer.h"
#include "passes/kernel_config.h"
#include "pipeline/frame_inputs.h"
#include "pipeline/frame_passes.h"

namespace ewa::train {

/// Whether an image that is not read yet may have pixels that its alpha cuts out.
bool may_be_cut(const Frame& frame);

/// A frame's image on the host, with depths if the loss compares depths.
struct LoadedPhoto {
    std::shared_ptr<const Image> image;
    pipeline::PhotoTexels texels;  // of the image
    Image depths;
};

/// The device memory, in bytes, of the frame's image and depths at this size in px.
uint64_t photo_bytes_of(const Frame& frame, int width, int height, const LossWeights& loss);

/// The source of the depths that the loss compares: the frame's depth map, or the points that the frame sees.
struct DepthSource {
    bool maps = false;
    std::vector<glm::dvec3> points;  // world
};

/// Caches decoded images on the device up to a number of bytes: the first frames that fit. The others are read again at each use.
/// The choice of cached images changes no result. Besides the cache, the device stores one image, and one more is being read.
class ImageCache {
  public:
    /// Loads and uploads the cached images, with width and height divided by `reduction`. frames: indices into dataset.frames.
    /// origin: of the model's means, world units. loss: decides which depths are loaded with the images. Throws InputError that
    /// names the frame.
    ImageCache(gpu::Device& device, const passes::KernelConfig& config, const Dataset& dataset,
               const std::vector<int>& frames, uint64_t cache_bytes, const glm::dvec3& origin,
               int reduction = 1, const LossWeights& loss = {});

    size_t count() const { return photos_.size(); }
    /// Whether photo(i) returns at once.
    bool cached(size_t i) const { return bool(photos_[i].texels); }
    size_t on_disk() const { return on_disk_; }

    /// An image as the loss reads it. Valid until the next call of photo.
    struct Photo {
        gpu::Buffer texels;         // empty: on disk
        bool masked = false;        // its alpha weights the pixels, and some weigh less than 1
        bool cut = false;           // its alpha cuts pixels out
        double weight = 1;          // with a mask: with a mask: mean square of the pixels' weights; else 1
        gpu::Buffer depths;         // depths of a map or of points, as the loss reads them; empty: none
        uint64_t depth_pixels = 0;  // number of pixels in the mean of the loss's depth term
    };
    /// Reads image i if it is not cached. The device must be idle. Throws InputError.
    const Photo& photo(size_t i);
    /// Starts reading image i in the background for the next call of photo, if it is not cached.
    void prepare(size_t i);

    /// Whether an image may be masked.
    bool any_masked() const { return any_masked_; }
    /// Whether some image has depths that the loss compares.
    bool any_depths() const { return any_depths_; }
    /// Whether an image may be cut out by its alpha.
    bool any_cut() const { return any_cut_; }
    pipeline::CameraUse camera(size_t i) const;

  private:
    Photo upload(const Frame& frame, const LoadedPhoto& loaded) const;

    gpu::Device& device_;
    std::unique_ptr<DepthSource> depths_;
    std::vector<Frame> frames_;
    std::vector<Photo> photos_;
    size_t on_disk_ = 0;
    bool any_masked_ = false, any_cut_ = false, any_depths_ = false;
    Photo visitor_;  // the last image that was read from disk
    size_t coming_ = 0;
    std::future<LoadedPhoto> reading_;
    gpu::Buffer cameras_;
    uint64_t camera_stride_ = 0;
};

/// The training images by downsample level: 0 is the full resolution, and each level halves the sides.
class ImageLevels {
  public:
    /// The arguments are those of ImageCache. Each level gets cache_share of TrainOptions::image_cache_bytes.
    ImageLevels(gpu::Device& device, const passes::KernelConfig& config, const Dataset& dataset,
                const std::vector<int>& frames, const TrainOptions& options, const glm::dvec3& origin);

    size_t count() const { return full().count(); }
    const ImageCache& full() const { return levels_.front(); }
    const ImageCache& lowest() const { return levels_.back(); }
    /// Whether at(level) frees images.
    bool frees(size_t level) const { return levels_.size() > level + 1; }
    /// The images of a level. Frees those of lower resolutions, since resolutions only rise.
    ImageCache& at(size_t level);

  private:
    std::vector<ImageCache> levels_;
};

/// The index of the training image of a step. step: from 1. Each epoch shows all `count` images once, in an order that depends on
/// epoch and seed only.
size_t frame_of_step(int step, size_t count, uint64_t seed);

}  // namespace ewa::train
