// SPDX-License-Identifier: Apache-2.0
// The device memory of a training, before it allocates any.
#include <algorithm>

#include "ewa/trainer.h"
#include "gpu/device.h"
#include "passes/shape.h"
#include "pipeline/capacity.h"
#include "pipeline/model.h"
#include "pipeline/photo.h"
#include "pipeline/sizes.h"
#include "train/schedule.h"

namespace ewa {

using train::cache_share;

MemoryEstimate estimate_memory(const gpu::Device& device, const Dataset& dataset,
                               const std::vector<int>& train_frames, const Gaussians& start,
                               const TrainOptions& given) {
    const TrainOptions options = resolve(given, dataset);
    MemoryEstimate estimate;
    const bool grows = options.strategy != Strategy::none;
    estimate.splats = grows ? std::max(options.max_splats, uint32_t(start.size())) : uint32_t(start.size());
    const uint64_t statistics = options.strategy == Strategy::adc ? 8ull * estimate.splats : 0;
    const uint64_t generation = 3 * pipeline::parameter_bytes(estimate.splats, start.sh_degree) + statistics;
    estimate.model = grows ? 2 * generation : generation;

    std::vector<uint64_t> cached_at(size_t(options.halvings) + 1);
    const passes::Shape shape = passes::shape_for(device.limits());
    for (const int index : train_frames) {
        const Frame& frame = dataset.frames[size_t(index)];
        const auto width = uint32_t(frame.camera.width), height = uint32_t(frame.camera.height);
        const auto pairs = std::max(pipeline::first_capacity(estimate.splats),
                                    uint32_t(std::min<uint64_t>(8ull * estimate.splats, 0xe0000000u)));
        const pipeline::FrameRequest request{
            estimate.splats, width, height, pairs, true, false, frame.masks == MaskUse::ignore,
            options.exposure};
        estimate.frame = std::max(estimate.frame, sizes_for(shape, request).total());
        const uint64_t photo = pipeline::photo_bytes(int(width), int(height), frame.eight_bit);
        for (int h = 0; h <= options.halvings; ++h) {
            uint64_t& cached = cached_at[size_t(h)];
            if (cached + (photo >> 2 * h) <= cache_share(options, h)) cached += photo >> 2 * h;
        }
    }
    for (const uint64_t cached : cached_at) estimate.images += cached;
    return estimate;
}

}  // namespace ewa
