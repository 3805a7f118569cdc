// SPDX-License-Identifier: Apache-2.0
#include "scene/frame_images.h"

#include "core/parallel.h"

namespace ewa::scene {

std::shared_ptr<const Image> image_of(const Frame& frame) {
    const auto kept = frame.kept.lock();
    if (kept && kept->downscale == frame.downscale && kept->left_out == frame.left_out)
        return {kept, &kept->image};
    return std::make_shared<const Image>(load_frame_image(frame));
}

KeptImages read_images(Dataset& dataset, const std::vector<int>& indices) {
    constexpr uint64_t kMostValues = 1 << 25;
    std::vector<Frame*> frames;
    uint64_t values = 0;
    for (const int index : indices) {
        Frame& frame = dataset.frames[size_t(index)];
        values += 4 * uint64_t(frame.camera.width) * uint64_t(frame.camera.height);
        if (values > kMostValues) break;
        frames.push_back(&frame);
    }
    KeptImages images(frames.size());
    core::on_all_cores(
        frames.size(),
        [&](size_t i) {
            const Frame& frame = *frames[i];
            images[i] = std::make_shared<const KeptImage>(
                KeptImage{load_frame_image(frame), frame.downscale, frame.left_out});
        },
        images_at_once({frames.begin(), frames.end()}));
    for (size_t i = 0; i < frames.size(); ++i) frames[i]->kept = images[i];
    return images;
}

}  // namespace ewa::scene
