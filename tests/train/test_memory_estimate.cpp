// SPDX-License-Identifier: Apache-2.0
// The estimate of a frame's memory, with the lists of splats that the kernels may have.
#include "train/memory_estimate.h"

#include <gtest/gtest.h>

#include <cmath>

#include "gpu/executor.h"
#include "gpu/test_device.h"
#include "pipeline/frame_passes.h"
#include "pipeline/model.h"
#include "pipeline/plan.h"
#include "support/random_scene.h"
#include "train/schedule.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

/// A view of splats that lie within it with their footprints, each of which reaches tens of tiles.
struct LargeSplats {
    Gaussians splats;
    Dataset dataset;

    LargeSplats() {
        Random random(31);
        splats.resize(6000);
        for (size_t i = 0; i < splats.size(); ++i) {
            for (size_t k = 0; k < 3; ++k) {
                splats.means[3 * i + k] = float(random.uniform(-0.7, 0.7)) + (k == 2 ? 4.0f : 0.0f);
                splats.log_scales[3 * i + k] = float(std::log(random.uniform(0.05, 0.2)));
            }
            for (size_t k = 0; k < 4; ++k) splats.quaternions[4 * i + k] = float(random.normal());
            splats.opacity_logits[i] = float(random.uniform(0.5, 3));
        }
        Camera& camera = dataset.frames.emplace_back().camera;
        camera.width = 320;
        camera.height = 300;
        camera.fx = camera.fy = 320;
        camera.cx = 160;
        camera.cy = 150;
        dataset.frames.front().eight_bit = true;
    }
};

/// The bytes of a frame's buffers, and the pairs of a splat and a list that a device has counted.
struct CountedFrame {
    uint64_t bytes = 0;
    uint32_t pairs = 0;

    CountedFrame(const passes::KernelConfig& config, const LargeSplats& scene, const pipeline::Plan& plan) {
        passes::PassCache cache(*device(), config);
        gpu::Executor executor(*device());
        pipeline::FrameBuffers frame;
        const Camera& view = scene.dataset.frames.front().camera;
        const pipeline::Model model = pipeline::upload_model(*device(), scene.splats, 1, false);
        const gpu::Buffer camera = pipeline::upload_camera(*device(), view, config, model.origin);
        const pipeline::FrameInputs inputs = pipeline::inputs_of(camera, view, {});
        pipeline::FrameRequest size =
            pipeline::frame_request(plan, inputs.camera.width, inputs.camera.height);
        size.splats = model.splats;
        size.instances = 1;
        size.instances = pairs =
            run_until_it_fits(cache, executor, frame, size, [&](const passes::Recorder& on) {
                pipeline::FramePasses{on, plan, frame, inputs}.forward(model);
            }).instances;
        bytes = pipeline::sizes_for(config, size).total();
    }
};

TEST(MemoryEstimate, CountsTheListsOfQuads) {
    const LargeSplats scene;
    const std::vector<int> frames = all_frames(scene.dataset);
    TrainOptions options;
    options.strategy = Strategy::none;
    options.max_splats = 6000;
    options = resolve(options, scene.dataset, frames);
    const pipeline::Plan plan = pipeline::plan_for(train::plan_request(scene.splats, options, false));
    passes::KernelConfig config = passes::config_for(device()->limits());
    const auto expect_estimated = [&](const CountedFrame& counted) {
        const uint64_t estimate =
            train::MemoryEstimator(config, scene.dataset, frames, scene.splats, options).up_to(6000).frame;
        printf("    %u pairs: estimate %.0f KiB, buffers %.0f KiB\n", counted.pairs, double(estimate) / 1024,
               double(counted.bytes) / 1024);
        EXPECT_NEAR(double(estimate) / double(counted.bytes), 1, 0.15);
    };
    const CountedFrame tiles(config, scene, plan);
    expect_estimated(tiles);
    config.quads = passes::most_quads(device()->limits());
    ASSERT_GT(config.quads, 0u);
    const CountedFrame quads(config, scene, plan);
    expect_estimated(quads);
    // So that one estimate cannot be both.
    EXPECT_LT(double(quads.bytes), 0.6 * double(tiles.bytes));
}

}  // namespace
}  // namespace ewa::test
