// SPDX-License-Identifier: Apache-2.0
// Kernels that a device may choose between compute the same bytes, on any device.
#include <gtest/gtest.h>

#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "pipeline/backward.h"

namespace ewa::test {
namespace {

struct FrameBytes {
    std::vector<float> planes, gradient;
    std::vector<uint32_t> splats, indices;

    bool operator==(const FrameBytes&) const = default;
};

FrameBytes frame_with(const passes::KernelConfig& config, const Scene& scene) {
    passes::PassCache cache(*device(), config);
    const uint32_t width = uint32_t(scene.camera.width), height = uint32_t(scene.camera.height);
    const pipeline::Model model = pipeline::upload_model(*device(), scene.gaussians, 1, false);
    const gpu::Buffer camera = camera_buffer(scene.camera, config);
    const gpu::Buffer photo =
        pipeline::upload_photo(*device(), random_target(9, scene.camera.width, scene.camera.height));
    const pipeline::Plan plan = pipeline::plan_for({.purpose = pipeline::Purpose::gradient,
                                                    .scene_degree = scene.gaussians.sh_degree,
                                                    .present_degree = scene.gaussians.sh_degree,
                                                    .render = scene.options});
    const pipeline::FrameInputs inputs{{&camera, 0, width, height}, scene.options.background};
    pipeline::FrameBuffers frame;
    pipeline::Sorted sorted;
    const shared::Counts counts = run_until_it_fits(
        cache, rig().executor, frame,
        {.splats = model.splats, .width = width, .height = height, .instances = 40000, .gradients = true},
        [&](const passes::Recorder& recorder) {
            const pipeline::FramePasses on{recorder, plan, frame, inputs};
            sorted = on.forward(model);
            on.loss(photo);
            on.backward(model, sorted, {});
        });
    EXPECT_GT(counts.instances, 2000u);
    return {frame.planes.download<float>(frame.sizes.planes / 4),
            model.moments1.download<float>(model.moments1.bytes() / 4),
            sorted.splats->download<uint32_t>(counts.instances),
            sorted.indices->download<uint32_t>(counts.instances)};
}

class KernelChoices : public testing::TestWithParam<SplatKind> {};

TEST_P(KernelChoices, ChangeNoByteOfAFrame) {
    const Scene scene = random_scene(4100, 900, GetParam(), 131, 93, 2);
    const passes::KernelConfig own = rig().config();
    const FrameBytes expected = frame_with(own, scene);
    passes::KernelConfig other = own;
    other.ranked_sort = !own.ranked_sort;
    EXPECT_TRUE(frame_with(other, scene) == expected) << "the other sort";
    other = own;
    other.optimised_modules = false;
    EXPECT_TRUE(frame_with(other, scene) == expected) << "whole modules";
    for (const uint32_t broadcast :
         {shared::BROADCAST_SHUFFLES, shared::BROADCAST_SHARED, shared::BROADCAST_UNIFORM}) {
        other = own;
        other.broadcast = broadcast;
        EXPECT_TRUE(frame_with(other, scene) == expected) << "broadcast " << broadcast;
    }
    other = own;
    other.tile_interleave = own.tile_interleave == 1 ? 16 : 1;
    EXPECT_TRUE(frame_with(other, scene) == expected) << "other order of tiles";
}

INSTANTIATE_TEST_SUITE_P(Kinds, KernelChoices,
                         testing::Values(SplatKind::ordinary, SplatKind::mixed, SplatKind::needles),
                         [](const auto& kind) { return std::string(name_of(kind.param)); });

}  // namespace
}  // namespace ewa::test
