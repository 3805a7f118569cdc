// SPDX-License-Identifier: Apache-2.0
// The images of frames: how many may be decoded at once, and a cache, so that each is decoded once.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::scene {

/// The number of decoded images that take about 1 GiB as four float32 channels; at least one. frames: the frames of the images.
inline size_t images_at_once(const std::vector<const Frame*>& frames) {
    constexpr uint64_t kPixels = 1 << 26;
    uint64_t largest = 1;
    for (const Frame* frame : frames)
        largest = std::max(largest, uint64_t(frame->source.width) * uint64_t(frame->source.height));
    return size_t(std::max<uint64_t>(1, kPixels / largest));
}

/// The cached image of the frame, or else the result of load_frame_image. Throws as that does.
std::shared_ptr<const Image> image_of(const Frame& frame);

using KeptImages = std::vector<std::shared_ptr<const KeptImage>>;
/// Decodes the images of these frames on all cores, until 128 MiB are full (as four float32 channels). image_of returns these
/// images while the result exists. Throws as load_frame_image does.
KeptImages read_images(Dataset& dataset, const std::vector<int>& indices);

/// The frames with these indices.
inline std::vector<const Frame*> frames_at(const Dataset& dataset, const std::vector<int>& indices) {
    std::vector<const Frame*> frames;
    for (const int index : indices) frames.push_back(&dataset.frames[size_t(index)]);
    return frames;
}

}  // namespace ewa::scene
