#include "train/photographs.h"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "core/random.h"
#include "ewa/error.h"
#include "pipeline/camera_block.h"
#include "pipeline/photo.h"

namespace ewa::train {

namespace {

bool transparent(const Image& image) {
    bool found = false;
    for (size_t i = 3; image.channels == 4 && i < image.pixels.size(); i += 4)
        found = found || image.pixels[i] < 1;
    return found;
}

}  // namespace

Photographs::Photographs(gpu::Device& device, const passes::Shape& shape, const Dataset& dataset,
                         const std::vector<int>& frames) {
    const uint64_t align = std::max<uint64_t>(device.limits().uniform_alignment, 16);
    camera_stride_ = (sizeof(shared::CameraBlock) + align - 1) / align * align;
    std::vector<std::byte> blocks(camera_stride_ * std::max<size_t>(frames.size(), 1));
    for (size_t i = 0; i < frames.size(); ++i) {
        const Frame& frame = dataset.frames[size_t(frames[i])];
        const Image image = load_frame_image(frame);
        if (image.width != frame.camera.width || image.height != frame.camera.height)
            throw InputError("frame " + frame.name + " changed its size while it was read");
        const shared::CameraBlock block = pipeline::camera_block(frame.camera, shape);
        std::memcpy(&blocks[i * camera_stride_], &block, sizeof(block));
        photos_.push_back(pipeline::upload_photo(device, image));
        masked_.push_back(frame.masks == MaskUse::ignore && transparent(image));
        sizes_.push_back({uint32_t(image.width), uint32_t(image.height)});
        max_width_ = std::max(max_width_, sizes_.back().width);
        max_height_ = std::max(max_height_, sizes_.back().height);
    }
    cameras_ = gpu::Buffer(device, "cameras", blocks.size(), gpu::Texel::none, true);
    cameras_.upload(std::span<const std::byte>(blocks));
}

pipeline::CameraUse Photographs::camera(size_t i) const {
    return {&cameras_, i * camera_stride_, sizes_[i].width, sizes_[i].height};
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
