// SPDX-License-Identifier: Apache-2.0
// Kernels that a device may choose between compute the same bytes, on any device. Quads add the sums of gradients in another order.
#include <gtest/gtest.h>

#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "pipeline/backward.h"
#include "pipeline/views.h"
#include "support/gradient_check.h"
#include "support/random_lens.h"

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

/// A frame that at first has room for `capacity` instances, and is repeated until it fits.
FrameBytes repeated_frame_with(const passes::KernelConfig& config, const Scene& scene, uint32_t capacity) {
    passes::PassCache cache(*device(), config);
    const pipeline::Model model = pipeline::upload_model(*device(), scene.gaussians, 1, false);
    const gpu::Buffer camera = camera_buffer(scene.camera, config);
    const gpu::Buffer photo =
        pipeline::upload_photo(*device(), random_target(9, scene.camera.width, scene.camera.height));
    const pipeline::Plan plan = pipeline::plan_for({.purpose = pipeline::Purpose::gradient,
                                                    .scene_degree = scene.gaussians.sh_degree,
                                                    .present_degree = scene.gaussians.sh_degree,
                                                    .render = scene.options});
    const pipeline::FrameInputs inputs = pipeline::inputs_of(camera, scene.camera, scene.options);
    pipeline::FrameRequest size = pipeline::frame_request(plan, inputs.camera.width, inputs.camera.height);
    size.splats = model.splats;
    size.instances = capacity;
    pipeline::FrameBuffers frame;
    pipeline::Sorted sorted;
    const shared::Counts counts =
        run_until_it_fits(cache, rig().executor, frame, size, [&](const passes::Recorder& recorder) {
            const pipeline::FramePasses on{recorder, plan, frame, inputs};
            sorted = on.forward(model);
            on.loss(photo);
            on.backward(model, sorted, {});
        });
    EXPECT_GT(counts.instances, 2000u);
    return {.planes = frame.planes.download<float>(frame.sizes.planes / 4),
            .weights = {},
            .splats = sorted.splats->download<uint32_t>(counts.instances),
            .indices = sorted.indices->download<uint32_t>(counts.instances),
            .gradient = download_model(model, model.moments1)};
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
    other = own;
    other.ranked_sort = true;
    other.few_blocks = 0;
    const FrameBytes enough = repeated_frame_with(own, scene, 40000);
    for (const bool live : {false, true}) {
        other.live_counts = live;
        EXPECT_TRUE(frame_with(other, scene) == expected) << "live counts " << live;
        EXPECT_TRUE(repeated_frame_with(other, scene, 1) == enough)
            << "after an overflow, live counts " << live;
    }
    other.few_blocks = 1000;
    EXPECT_TRUE(frame_with(other, scene) == expected) << "without scans of counters";
    EXPECT_TRUE(repeated_frame_with(other, scene, 1) == enough)
        << "after an overflow, without scans of counters";
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

/// As `config`, but that each tile's list is sorted by itself.
passes::KernelConfig with_lists(passes::KernelConfig config = rig().config()) {
    config.sorted_lists = passes::most_sorted_lists(device()->limits());
    return config;
}

/// The same splats in each list, and the same image and gradient.
void expect_same(const FrameBytes& actual, const FrameBytes& expected) {
    EXPECT_TRUE(actual.same_image(expected));
    EXPECT_TRUE(actual.same_gradient(expected));
    EXPECT_EQ(actual.splats, expected.splats);
}

TEST_P(KernelChoices, ListsThatAreSortedOneByOneChangeNoByte) {
    const Scene scene = random_scene(4101, 900, GetParam(), 131, 93, 2);
    const passes::KernelConfig own = rig().config();
    expect_same(frame_with(with_lists(), scene), frame_with(own, scene));
    // Also with buffers that share memory, and after an overflow.
    const FrameBytes enough = repeated_frame_with(own, scene, 40000);
    for (const uint32_t capacity : {1u, 40000u})
        expect_same(repeated_frame_with(with_lists(), scene, capacity), enough);
    passes::KernelConfig emitted = own;
    emitted.slots = shared::SLOTS_EMITTED;
    const FrameBytes lists = frame_with(with_lists(emitted), scene), expected = frame_with(own, scene);
    EXPECT_TRUE(lists.same_image(expected) && lists.same_gradient(expected));
    for (size_t k = 0; k < lists.splats.size(); ++k)
        ASSERT_EQ(lists.splats[lists.indices[k]], expected.splats[k]) << "instance " << k;
    EXPECT_TRUE(repeated_frame_with(with_lists(emitted), scene, 40000).same_gradient(enough));
    expect_same(frame_with(with_lists(), scene, {.render = {}}), frame_with(own, scene, {.render = {}}));
}

TEST(SortedListsOfAFrame, ServeSpheresRaysAndLongLists) {
    Scene scene = random_scene(4300, 300, SplatKind::ordinary, 61, 47, 1);
    for (const Integrator integrator : {Integrator::march, Integrator::ray, Integrator::fast_ray}) {
        scene.options.integrator = integrator;
        expect_same(frame_with(with_lists(), scene, {.render = {}}),
                    frame_with(rig().config(), scene, {.render = {}}));
    }
    scene.options.integrator = Integrator::splat;
    scene.options.points = true;
    expect_same(frame_with(with_lists(), scene, {.render = {}}),
                frame_with(rig().config(), scene, {.render = {}}));
    Scene dense = random_scene(3800, 10000, SplatKind::ordinary, 8, 8);
    for (float& logit : dense.gaussians.opacity_logits) logit = -5;
    for (float& scale : dense.gaussians.log_scales) scale = 1;
    expect_same(frame_with(with_lists(), dense), frame_with(rig().config(), dense));
}

/// More splats than the lists may have are sorted as ever.
TEST(SortedListsOfAFrame, HaveALimit) {
    passes::KernelConfig config = with_lists();
    const pipeline::FrameRequest most{.splats = config.sorted_lists, .width = 8, .height = 8, .instances = 1};
    pipeline::FrameRequest more = most;
    ++more.splats;
    EXPECT_TRUE(sizes_for(config, most).sorted_lists);
    EXPECT_EQ(sizes_for(config, most).counters, 0u);
    EXPECT_FALSE(sizes_for(config, more).sorted_lists);
    EXPECT_LT(sizes_for(config, most).total(), sizes_for(config, more).total());
    EXPECT_FALSE(sizes_for(rig().config(), most).sorted_lists);
}

passes::KernelConfig with_quads(uint32_t slots = shared::SLOTS_SORTED) {
    passes::KernelConfig config = rig().config();
    config.quads = passes::most_quads(device()->limits());
    config.slots = slots;
    EXPECT_GE(config.quads, config.subgroup);
    return config;
}

/// The gradients of two frames whose sums have other orders.
void expect_close(const FrameBytes& actual, const FrameBytes& expected) {
    GradientTolerance tolerance;
    tolerance.cosine = 1e-11;
    tolerance.norm = 2e-6;
    tolerance.element_relative = 1e-3;
    tolerance.element_absolute = 1e-6;
    EXPECT_TRUE(splat_gradients_agree(actual.gradient, expected.gradient, tolerance));
    const std::vector<double> sums(actual.sums.begin(), actual.sums.end()),
        expected_sums(expected.sums.begin(), expected.sums.end());
    EXPECT_TRUE(gradients_agree(sums, expected_sums, tolerance));
}

/// As KernelChoices, in a group that runs with other subgroup sizes too.
class QuadsBlendPass : public testing::TestWithParam<SplatKind> {
  protected:
    // Neither side is a whole number of tiles, nor of quads.
    const Scene scene = random_scene(4200, 700, GetParam(), 149, 83, 2);
};

TEST_P(QuadsBlendPass, DrawTheBytesOfTiles) {
    Scene each = scene;
    for (const Drawing drawing :
         {Drawing::color, Drawing::depth, Drawing::count, Drawing::ellipsoids, Drawing::median_depth}) {
        each.options.kernel = drawing == Drawing::depth   ? Footprint::antialias
                              : drawing == Drawing::count ? Footprint::density
                                                          : Footprint::peak;
        const pipeline::PlanRequest request{.render = {}, .drawing = drawing};
        const FrameBytes expected = frame_with(rig().config(), each, request),
                         actual = frame_with(with_quads(), each, request);
        EXPECT_TRUE(actual.same_image(expected)) << "drawing " << int(drawing);
        EXPECT_LT(actual.splats.size(), expected.splats.size());
    }
}

TEST_P(QuadsBlendPass, GradientsAreThoseOfTilesAndOfTheReference) {
    const FrameBytes tiles = frame_with(rig().config(), scene), quads = frame_with(with_quads(), scene);
    EXPECT_TRUE(quads.same_image(tiles));
    expect_close(quads, tiles);
    expect_same(frame_with(with_lists(with_quads()), scene), quads);
    const FrameBytes emitted = frame_with(with_quads(shared::SLOTS_EMITTED), scene);
    EXPECT_TRUE(emitted.same_image(tiles) && emitted.same_gradient(quads));
    const auto expected =
        reference::loss_gradient(scene.gaussians, scene.camera,
                                 random_target(9, scene.camera.width, scene.camera.height), scene.options);
    GradientTolerance tolerance;
    tolerance.norm = 2e-4;
    tolerance.element_relative = 1e-2;
    tolerance.element_absolute = 1e-4;
    EXPECT_TRUE(splat_gradients_agree(quads.gradient, expected.gradient, tolerance));
}

INSTANTIATE_TEST_SUITE_P(Kinds, QuadsBlendPass,
                         testing::Values(SplatKind::mixed, SplatKind::needles, SplatKind::opacity_extremes),
                         [](const auto& kind) { return std::string(name_of(kind.param)); });

/// Splats on the seam reach quads at both borders. The last quad of a row has one column of tiles, or two.
TEST(QuadsOfAPanorama, DrawTheBytesOfTiles) {
    const auto columns = [](int width) { return (width + 2 * 8 - 1) / (2 * 8); };
    ASSERT_NE(columns(100) % 2, columns(120) % 2);
    for (const int width : {100, 120}) {
        Scene scene;
        scene.camera = random_lenses(6800, width, 50)[4].camera;
        scene.gaussians = gaussians_around(6801, 400, scene.camera, 0);
        const FrameBytes tiles = frame_with(rig().config(), scene), quads = frame_with(with_quads(), scene);
        EXPECT_TRUE(quads.same_image(tiles)) << width;
        EXPECT_LT(quads.splats.size(), tiles.splats.size());
        expect_close(quads, tiles);
        for (size_t i = 0; i < scene.gaussians.size(); ++i) scene.gaussians.log_scales[3 * i] += 2;
        EXPECT_TRUE(frame_with(with_quads(), scene).same_image(frame_with(rig().config(), scene))) << width;
    }
}

}  // namespace
}  // namespace ewa::test
