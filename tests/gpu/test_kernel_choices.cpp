// SPDX-License-Identifier: Apache-2.0
// Kernels that a device may choose between compute the same bytes, on any device.
#include <gtest/gtest.h>

#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "pipeline/backward.h"
#include "pipeline/views.h"

namespace ewa::test {
namespace {

struct FrameBytes {
    std::vector<float> planes, weights;       // weights: the largest of each splat
    std::vector<uint32_t> splats, indices{};  // of instances
    Gaussians gradient{};
    std::vector<float> listed{}, sums{};  // the image of a view's list, and its gradients

    bool same_image(const FrameBytes& other) const {
        return planes == other.planes && weights == other.weights && listed == other.listed;
    }
    bool same_gradient(const FrameBytes& other) const {
        const Gaussians &a = gradient, &b = other.gradient;
        return a.means == b.means && a.quaternions == b.quaternions && a.log_scales == b.log_scales &&
               a.opacity_logits == b.opacity_logits && a.sh == b.sh && sums == other.sums;
    }
    bool operator==(const FrameBytes& other) const {
        return same_image(other) && same_gradient(other) && splats == other.splats &&
               indices == other.indices;
    }
};

/// A frame whose buffers hold NaN before, so that whatever the passes read and did not write shows.
FrameBytes frame_with(const passes::KernelConfig& config, const Scene& scene,
                      pipeline::PlanRequest request = {.purpose = pipeline::Purpose::gradient,
                                                       .render = {}}) {
    passes::PassCache cache(*device(), config);
    request.scene_degree = request.present_degree = scene.gaussians.sh_degree;
    request.render = scene.options;
    const pipeline::Plan plan = pipeline::plan_for(request);
    const pipeline::Model model = pipeline::upload_model(*device(), scene.gaussians, 1, false);
    const gpu::Buffer camera = camera_buffer(scene.camera, config);
    const gpu::Buffer photo =
        pipeline::upload_photo(*device(), random_target(9, scene.camera.width, scene.camera.height));
    const pipeline::FrameInputs inputs = pipeline::inputs_of(camera, scene.camera, scene.options);
    pipeline::FrameRequest size = pipeline::frame_request(plan, inputs.camera.width, inputs.camera.height);
    size.splats = model.splats;
    size.instances = 200000;
    size.overlaid = false;
    GuardedFrame guarded(config, size);
    Guarded weights("weights", std::vector<float>(model.splats));
    pipeline::Sorted sorted;
    rig().run([&](gpu::Recording& recording) {
        const pipeline::FramePasses on{{recording, cache}, plan, guarded.frame, inputs};
        sorted = on.forward(model);
        on.contributions(sorted, weights);
        if (!plan.gradients) return;
        on.loss(photo);
        on.backward(model, sorted, {});
    });
    EXPECT_TRUE(guarded.intact() && weights.intact());
    const uint32_t instances = guarded.frame.read_counts().instances;
    EXPECT_GT(instances, 100u);
    EXPECT_LE(instances, size.instances);
    FrameBytes bytes{.planes = guarded.frame.planes.download<float>(guarded.frame.sizes.planes / 4),
                     .weights = weights.read<float>(),
                     .splats = sorted.splats->download<uint32_t>(instances)};
    if (!plan.gradients) return bytes;
    bytes.gradient = download_model(model, model.moments1);
    bytes.indices = sorted.indices->download<uint32_t>(instances);
    pipeline::ViewBuffers buffers;
    buffers.reserve(*device(), model.splats, 1, 1, model.splats);
    rig().run([&](gpu::Recording& recording) {
        pipeline::FramePasses{{recording, cache}, plan, guarded.frame, inputs}.list(model, buffers, {});
    });
    const uint32_t seen = guarded.frame.read_counts().scan_total;
    Guarded sums("sums", pipeline::ViewBuffers::sum_bytes(plan, seen));
    rig().run([&](gpu::Recording& recording) {
        const pipeline::FramePasses on{{recording, cache}, plan, guarded.frame, inputs};
        recording.copy(buffers.visible, 0, guarded.frame.records, 0, 48ull * seen);
        const pipeline::Sorted list = on.draw_list(seen);
        on.loss(photo);
        on.list_backward(seen, list, sums, 0);
    });
    EXPECT_TRUE(guarded.intact() && sums.intact());
    bytes.listed = guarded.frame.planes.download<float>(guarded.frame.sizes.planes / 4);
    bytes.sums = sums.read<float>();
    return bytes;
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
    other = own;
    other.slots = shared::SLOTS_EMITTED;
    const FrameBytes emitted = frame_with(other, scene);
    EXPECT_TRUE(emitted.same_image(expected) && emitted.same_gradient(expected)) << "slots as emitted";
    for (size_t k = 0; k < emitted.splats.size(); ++k)
        ASSERT_EQ(emitted.splats[emitted.indices[k]], expected.splats[k]) << "instance " << k;
}

INSTANTIATE_TEST_SUITE_P(Kinds, KernelChoices,
                         testing::Values(SplatKind::ordinary, SplatKind::mixed, SplatKind::needles),
                         [](const auto& kind) { return std::string(name_of(kind.param)); });

}  // namespace
}  // namespace ewa::test
