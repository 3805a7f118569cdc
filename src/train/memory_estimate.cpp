// SPDX-License-Identifier: Apache-2.0
// What a run needs, before it allocates anything: its plan and an estimate of its device memory.
#include <algorithm>

#include "ewa/trainer.h"
#include "gpu/device.h"
#include "passes/kernel_config.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/frame_inputs.h"
#include "pipeline/model.h"
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
    const pipeline::Plan plan = pipeline::plan_for(train::plan_request(start, options, false));
    const uint64_t statistics = plan.statistics ? 8ull * estimate.splats : 0;
    const uint64_t generation = 3 * pipeline::parameter_bytes(estimate.splats, start.sh_degree) + statistics;
    estimate.model = grows ? 2 * generation : generation;

    std::vector<uint64_t> cached_at(size_t(options.halvings) + 1);
    const passes::KernelConfig config = passes::config_for(device.limits());
    for (const int index : train_frames) {
        const Frame& frame = dataset.frames[size_t(index)];
        const auto width = uint32_t(frame.camera.width), height = uint32_t(frame.camera.height);
        const auto pairs = std::max(pipeline::first_capacity(estimate.splats),
                                    uint32_t(std::min<uint64_t>(8ull * estimate.splats, 0xe0000000u)));
        const pipeline::FrameRequest request{.splats = estimate.splats,
                                             .width = width,
                                             .height = height,
                                             .instances = pairs,
                                             .gradients = true,
                                             .masks = frame.masks == MaskUse::ignore,
                                             .exposure = plan.exposure};
        estimate.frame = std::max(estimate.frame, sizes_for(config, request).total());
        const uint64_t photo = pipeline::photo_bytes(int(width), int(height), frame.eight_bit);
        for (int h = 0; h <= options.halvings; ++h) {
            uint64_t& cached = cached_at[size_t(h)];
            if (cached + (photo >> 2 * h) <= cache_share(options, h)) cached += photo >> 2 * h;
        }
    }
    for (const uint64_t cached : cached_at) estimate.images += cached;
    return estimate;
}

std::vector<PlanLine> plan_lines(const Gaussians& start, const TrainOptions& options, bool masks) {
    const pipeline::Plan plan = pipeline::plan_for(train::plan_request(start, options, masks));
    return pipeline::describe(plan, start.sh_degree, start.size());
}

}  // namespace ewa
