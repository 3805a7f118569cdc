// SPDX-License-Identifier: Apache-2.0
#include "train/image_cache.h"

#include <algorithm>
#include <cstring>
#include <deque>
#include <numeric>
#include <thread>

#include "core/random.h"
#include "core/text.h"
#include "ewa/error.h"
#include "pipeline/frame_inputs.h"
#include "scene/depth_map.h"
#include "scene/frame_images.h"
#include "train/schedule.h"

namespace ewa::train {
namespace {

/// The mean square of alpha: what a mean over a masked image's squared differences is short of.
double mean_weight(const Image& image) {
    double sum = 0;
    for (size_t i = 3; i < image.pixels.size(); i += 4) sum += double(image.pixels[i]) * image.pixels[i];
    return sum / (double(image.width) * image.height);
}

bool has_depths(const Frame& frame, const LossWeights& loss) {
    return (loss.sfm_depth > 0 && frame.seen) || (loss.depth > 0 && !frame.depth_path.empty());
}

LoadedPhoto load_photo(const Frame& frame, const DepthSource& depths) {
    LoadedPhoto loaded{scene::image_of(frame), {}, {}};
    loaded.texels = pipeline::photo_texels(*loaded.image, frame.eight_bit);
    if (!depths.points.empty() && frame.seen)
        loaded.depths = depths_of_points(frame, depths.points);
    else if (depths.maps && !frame.depth_path.empty())
        loaded.depths = load_depth_map(frame);
    if (!loaded.depths.pixels.empty()) drop_masked(loaded.depths, *loaded.image);
    return loaded;
}

/// Loads images on all cores and hands them out in order.
class ParallelLoader {
  public:
    ParallelLoader(std::vector<const Frame*> frames, const DepthSource& depths)
        : frames_(std::move(frames)), depths_(depths) {
        ahead_ = std::min<size_t>(scene::images_at_once(frames_),
                                  std::max(1u, std::thread::hardware_concurrency()));
    }

    /// Throws what load_frame_image and load_depth_map throw for this image.
    LoadedPhoto next() {
        for (; started_ < frames_.size() && loading_.size() < ahead_; ++started_)
            // Without a policy, an image whose thread cannot start is loaded by get.
            loading_.push_back(
                std::async([frame = frames_[started_], this] { return load_photo(*frame, depths_); }));
        std::future<LoadedPhoto> first = std::move(loading_.front());
        loading_.pop_front();
        return first.get();
    }

  private:
    std::vector<const Frame*> frames_;
    const DepthSource& depths_;
    size_t started_ = 0;
    size_t ahead_ = 1;
    std::deque<std::future<LoadedPhoto>> loading_;
};

}  // namespace

uint64_t photo_bytes_of(const Frame& frame, int width, int height, const LossWeights& loss) {
    const uint64_t map = has_depths(frame, loss) ? 4 * uint64_t(width) * uint64_t(height) : 0;
    return pipeline::photo_bytes(width, height, frame.eight_bit) + map;
}

bool may_be_cut(const Frame& frame) {
    const std::string type = core::lower(frame.image_path.extension().string());
    return frame.masks == MaskUse::cut && !frame.left_out &&
           (!frame.mask_path.empty() || (type != ".jpg" && type != ".jpeg"));
}

ImageCache::ImageCache(gpu::Device& device, const passes::KernelConfig& config, const Dataset& dataset,
                       const std::vector<int>& frames, uint64_t cache_bytes, const glm::dvec3& origin,
                       int reduction, const LossWeights& loss)
    : device_(device), depths_(std::make_unique<DepthSource>()), photos_(frames.size()) {
    depths_->maps = loss.depth > 0;
    if (loss.sfm_depth > 0) depths_->points = dataset.points.positions;
    const uint64_t align = std::max<uint64_t>(device.limits().uniform_alignment, 16);
    camera_stride_ = (sizeof(shared::CameraBlock) + align - 1) / align * align;
    std::vector<std::byte> blocks(camera_stride_ * std::max<size_t>(frames.size(), 1));
    uint64_t cached_bytes = 0;
    std::vector<size_t> cached;
    frames_.reserve(frames.size());  // the loader points into it
    for (size_t i = 0; i < frames.size(); ++i) {
        Frame& frame = frames_.emplace_back(dataset.frames[size_t(frames[i])]);
        if (reduction > 1) {
            frame.downscale *= reduction;
            frame.camera = downscale(frame.pinhole, frame.downscale);
        }
        const shared::CameraBlock block = pipeline::camera_block(frame.camera, config, origin);
        std::memcpy(&blocks[i * camera_stride_], &block, sizeof(block));
        const uint64_t bytes = photo_bytes_of(frame, frame.camera.width, frame.camera.height, loss);
        any_depths_ = any_depths_ || has_depths(frame, loss);
        if (cached_bytes + bytes <= cache_bytes) {
            cached_bytes += bytes;
            cached.push_back(i);
        } else {
            ++on_disk_;
            any_masked_ = any_masked_ || frame.alpha_weighs();
            any_cut_ = any_cut_ || may_be_cut(frame);
        }
    }
    std::vector<const Frame*> to_load;
    for (const size_t i : cached) to_load.push_back(&frames_[i]);
    ParallelLoader loader(std::move(to_load), *depths_);
    for (const size_t i : cached) {
        photos_[i] = upload(frames_[i], loader.next());
        any_masked_ = any_masked_ || photos_[i].masked;
        any_cut_ = any_cut_ || photos_[i].cut;
    }
    cameras_ = gpu::Buffer(device, "cameras", blocks.size(), gpu::Texel::none, true);
    cameras_.upload(std::span<const std::byte>(blocks));
}

ImageCache::Photo ImageCache::upload(const Frame& frame, const LoadedPhoto& loaded) const {
    const Image& image = *loaded.image;
    if (image.width != frame.camera.width || image.height != frame.camera.height)
        throw InputError("frame " + frame.name + " changed its size while it was read");
    const bool partly = pipeline::transparent(image), masked = partly && frame.alpha_weighs();
    gpu::Buffer depths;
    // Points say nothing of the pixels between them.
    const auto& values = loaded.depths.pixels;
    const uint64_t counted =
        depths_->maps ? values.size() : values.size() - size_t(std::ranges::count(values, 0.0f));
    if (counted > 0) {
        depths = gpu::Buffer(device_, "depth map", 4 * loaded.depths.pixels.size());
        depths.upload(std::span<const float>(loaded.depths.pixels));
    }
    return {pipeline::upload_photo(device_, loaded.texels),
            masked,
            partly && !masked && frame.masks == MaskUse::cut,
            masked ? mean_weight(image) : 1,
            std::move(depths),
            counted};
}

const ImageCache::Photo& ImageCache::photo(size_t i) {
    if (photos_[i].texels) return photos_[i];
    prepare(i);
    const LoadedPhoto loaded = reading_.get();
    visitor_ = {};  // frees its memory first
    return visitor_ = upload(frames_[i], loaded);
}

void ImageCache::prepare(size_t i) {
    if (photos_[i].texels || (reading_.valid() && coming_ == i)) return;
    coming_ = i;
    reading_ = std::async(std::launch::async,
                          [&frame = frames_[i], &depths = *depths_] { return load_photo(frame, depths); });
}

pipeline::CameraUse ImageCache::camera(size_t i) const {
    const Camera& camera = frames_[i].camera;
    return pipeline::use_of(cameras_, i * camera_stride_, camera);
}

ImageLevels::ImageLevels(gpu::Device& device, const passes::KernelConfig& config, const Dataset& dataset,
                         const std::vector<int>& frames, const TrainOptions& options,
                         const glm::dvec3& origin) {
    for (int level = 0; level <= options.halvings; ++level)
        levels_.emplace_back(device, config, dataset, frames, cache_share(options, level), origin, 1 << level,
                             options.loss);
}

ImageCache& ImageLevels::at(size_t level) {
    while (frees(level)) levels_.pop_back();
    return levels_[level];
}

size_t frame_of_step(int step, size_t count, uint64_t seed) {
    const uint32_t epoch = uint32_t(size_t(step - 1) / count);
    std::vector<std::pair<uint32_t, uint32_t>> order(count);
    for (uint32_t i = 0; i < count; ++i)
        order[i] = {core::pcg4d({i, epoch, uint32_t(seed), uint32_t(seed >> 32) ^ 0x66726d65u})[0], i};
    const auto place = order.begin() + std::ptrdiff_t(size_t(step - 1) % count);
    std::nth_element(order.begin(), place, order.end());
    return place->second;
}

}  // namespace ewa::train
