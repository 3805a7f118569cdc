// SPDX-License-Identifier: Apache-2.0
#include "run/first_kernels.h"

#include <algorithm>
#include <exception>

#include "ewa/training_needs.h"
#include "pipeline/backward.h"
#include "pipeline/frame_passes.h"
#include "pipeline/strategy.h"
#include "train/schedule.h"

namespace ewa::train {

using namespace pipeline;

bool has_plain_step(const RunOptions& options) {
    const TrainOptions& train = options.train;
    return !options.resume && options.ranks->size() == 1 && train.batch == 1 && train.bands == 1 &&
           train.device_memory_bytes == 0;
}

FirstStep first_step(const RunInput& input) {
    // Images decide on an appearance. Most have none.
    TrainOptions options = input.options.train;
    if (options.appearance == AppearanceModel::automatic) options.appearance = AppearanceModel::none;
    options = resolve(options, input.dataset, input.split.train);
    const Frame& frame = input.dataset.frames[size_t(input.split.train.front())];
    return {options, downscale(frame.pinhole, frame.downscale << options.halvings), input.split.train.size(),
            input.options.init == "sfm" ? input.dataset.points.positions.size() : 1};
}

void compile_kernels(gpu::Device& device, const FirstStep& step) try {
    // Kernels hardly depend on the size of a large frame, but its buffers take memory.
    constexpr int kMostSide = 1024;
    constexpr size_t kMostSplats = 1 << 15;
    Gaussians one;
    one.sh_degree = step.options.sh_degree;
    one.resize(1);
    Camera camera = step.camera;
    camera.width = std::min(camera.width, kMostSide);
    camera.height = std::min(camera.height, kMostSide);
    passes::PassCache cache(device);
    const Plan plan = plan_for(plan_request(one, step.options, false, step.photos, false));
    FrameRequest request = frame_request(plan, uint32_t(camera.width), uint32_t(camera.height));
    request.splats = uint32_t(std::clamp<size_t>(step.splats, 1, kMostSplats));
    request.instances = first_capacity(request.splats);
    FrameBuffers frame;
    frame.reserve(device, cache.config(), request);
    const Model model = upload_model(device, one, plan.moment_buffers(), plan.statistics);
    const gpu::Buffer photo(device, "photo", 16, gpu::Texel::rgba8),
        block = upload_camera(device, camera, cache.config());
    FrameInputs inputs = inputs_of(block, camera, step.options.render);
    inputs.sh_degree = schedule_for(step.options, step.photos).degree(1);
    gpu::Recording unused(device.limits());
    const FramePasses on{{unused, cache}, plan, frame, inputs};
    const Sorted sorted = on.forward(model);
    on.loss(photo);
    on.backward(model, sorted, {});
    if (step.options.strategy == Strategy::mcmc) record_noise(on, model, frame, {});
} catch (const std::exception&) {
    // The run itself will say what is wrong.
}

}  // namespace ewa::train
