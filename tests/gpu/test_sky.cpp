// SPDX-License-Identifier: Apache-2.0
// The sky on the device against the CPU reference: the image over it, its gradient, and Adam's steps.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "ewa/renderer.h"
#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "pipeline/sky.h"
#include "reference/render.h"
#include "reference/sky.h"
#include "reference/training.h"
#include "support/random_lens.h"
#include "support/random_sky.h"

namespace ewa::test {
namespace {

struct SkyCase {
    int width, height;
    uint64_t seed;
    double zoom = 1;  // of the focal lengths
    int lens = -1;    // of random_lenses; else a pinhole
};

/// A camera with light that reaches the sky, and dL/d(image).
struct SkyInputs {
    Camera camera;
    reference::Raster color, left, gradient;

    explicit SkyInputs(const SkyCase& c)
        : camera(random_camera(c.seed, c.width, c.height)),
          color(reference::to_double(random_target(c.seed + 1, c.width, c.height))),
          left(c.width, c.height, 1),
          gradient(c.width, c.height, 3) {
        if (c.lens >= 0) camera = random_lenses(c.seed, c.width, c.height).at(size_t(c.lens)).camera;
        if (c.zoom != 1 && camera.distortion.lens == Lens::fisheye)  // folds over at 74 degrees
            camera.distortion = {.k1 = -0.2, .lens = Lens::fisheye};
        camera.fx *= c.zoom;
        camera.fy *= c.zoom;
        Random random(c.seed + 2);
        for (double& value : left.values) value = float(random.uniform(0, 1));
        // Of the size of the loss's.
        const double scale = 1.0 / (3.0 * c.width * c.height);
        for (size_t i = 0; i < gradient.values.size(); ++i)
            gradient.values[i] = float(scale * ((i % 3 == 1 ? -1 : 1) + 0.5 * random.normal()));
    }
    /// As the blend pass leaves them.
    reference::Raster planes() const {
        reference::Raster all(color.width, color.height, 4);
        for (int y = 0; y < all.height; ++y)
            for (int x = 0; x < all.width; ++x) {
                std::copy_n(color.at(x, y), 3, all.at(x, y));
                all.at(x, y)[3] = left.at(x, y)[0];
            }
        return all;
    }
};

pipeline::FrameRequest sky_request(int width, int height) {
    return {
        .splats = 1, .width = uint32_t(width), .height = uint32_t(height), .instances = 1, .gradients = true};
}

/// The slots of three views of a step, after the gradient of the second.
struct SkySlots {
    GuardedFrame guarded;
    pipeline::LearnedSky sky{*device(), 3};

    explicit SkySlots(const SkyInputs& s)
        : guarded(rig().config(), sky_request(s.camera.width, s.camera.height)) {
        pipeline::FrameBuffers& frame = guarded.frame;
        const auto planes = pack_planes(s.planes(), 4, frame.sizes.stride);
        frame.planes.upload(std::span<const float>(planes));
        const auto by_image = pack_planes(s.gradient, 3, frame.sizes.stride);
        frame.image_gradient.upload(std::span<const float>(by_image));
        const shared::Counts counts{};
        frame.counts.upload(std::span<const shared::Counts>(&counts, 1));
        const gpu::Buffer block = camera_buffer(s.camera, rig().config());
        const auto inputs = pipeline::inputs_of(block, s.camera, {});
        const pipeline::Plan plan;
        rig().run([&](gpu::Recording& recording) {
            recording.fill(sky.slots, 7, 0, sky.slots.bytes());
            pipeline::FramePasses{{recording, rig().cache}, plan, frame, inputs}.sky_gradient(sky, 1);
        });
        EXPECT_TRUE(guarded.intact());
    }
    std::vector<int32_t> all() const { return sky.slots.download<int32_t>(sky.slots.bytes() / 4); }
    /// The slot of the second view.
    std::vector<double> gradient() const {
        std::vector<double> values;
        for (const int32_t value : sky.slots.download<int32_t>(sky.bytes() / 4, sky.bytes()))
            values.push_back(value / shared::SKY_UNITS);
        return values;
    }
};

reference::Sky size_of_learned() {
    return random_sky(1, int(pipeline::kLearnedSkySize));  // the gradient does not depend on the texels
}

class Sky : public testing::TestWithParam<SkyCase> {};

TEST_P(Sky, GradientMatchesTheReference) {
    const SkyInputs s(GetParam());
    const SkySlots slots(s);
    const std::vector<double> expected = sky_gradient(size_of_learned(), s.left, s.camera, s.gradient);
    const std::vector<double> actual = slots.gradient();
    double largest = 0;
    for (const double value : expected) largest = std::max(largest, std::abs(value));
    ASSERT_EQ(actual.size(), expected.size());
    for (size_t k = 0; k < expected.size(); ++k) {
        EXPECT_NEAR(actual[k], expected[k], 5e-4 * largest) << k;
        EXPECT_TRUE(actual[k] == 0 || expected[k] != 0) << k;
    }
    const std::vector<int32_t> all = slots.all();
    for (size_t k = 0; k < expected.size(); ++k) {
        ASSERT_EQ(all[k], 7) << "of another view";
        ASSERT_EQ(all[2 * expected.size() + k], 7);
    }
}

TEST(SkyGradient, SkipsAndCountsAPixelThatIsNotFiniteAndLimitsALargeOne) {
    SkyInputs s(SkyCase{20, 10, 60});
    s.gradient.at(9, 8)[1] = 20.0 / (3 * 200);  // with all light, 8 / (3 pixels) would be the limit
    s.left.at(9, 8)[0] = 1;
    SkyInputs limited = s;
    limited.gradient.at(9, 8)[1] = 8.0 / (3 * 200);
    s.gradient.at(3, 4)[2] = std::numeric_limits<double>::quiet_NaN();
    for (int c = 0; c < 3; ++c) limited.gradient.at(3, 4)[c] = 0;
    const SkySlots slots(s);
    EXPECT_EQ(slots.guarded.frame.read_counts().dropped_updates, 1u);
    const auto expected = sky_gradient(size_of_learned(), limited.left, limited.camera, limited.gradient);
    const auto actual = slots.gradient();
    for (size_t k = 0; k < expected.size(); ++k) EXPECT_NEAR(actual[k], expected[k], 1e-6) << k;
}

TEST_P(Sky, LiesBehindWhatWasBlended) {
    const SkyInputs s(GetParam());
    const Scene scene = random_scene(GetParam().seed + 5, 30, SplatKind::ordinary, 8, 8);
    for (const int size : {64, 5, 1}) {
        RenderOptions options;
        options.background = {1, 0, 0};  // not seen
        options.sky = std::make_shared<const SkyMap>(random_sky(GetParam().seed, size));
        Renderer renderer(device(), scene.gaussians, options);
        const Rendering actual = renderer.render(s.camera);
        const reference::Rendered expected = reference::render(scene.gaussians, s.camera, options);
        double apart = 0;
        for (size_t i = 0; i < actual.color.pixels.size(); ++i)
            apart += std::abs(double(actual.color.pixels[i]) - expected.blended.color.values[i]) > 2e-4;
        EXPECT_LE(apart, 1e-4 * double(actual.color.pixels.size()));
        // Another sky, and none, with the same renderer.
        DrawOptions other{.render = options};
        other.render.sky = std::make_shared<const SkyMap>(random_sky(GetParam().seed + 1, size));
        EXPECT_NE(renderer.render(s.camera, other).color.pixels, actual.color.pixels);
        other.render.sky.reset();
        Renderer without(device(), scene.gaussians, other.render);
        EXPECT_EQ(renderer.render(s.camera, other).color.pixels, without.render(s.camera).color.pixels);
    }
}

INSTANTIATE_TEST_SUITE_P(Sizes, Sky,
                         testing::Values(SkyCase{1, 1, 61}, SkyCase{61, 47, 62}, SkyCase{200, 131, 63},
                                         SkyCase{61, 47, 64, 0.1}, SkyCase{61, 47, 65, 0.01}));
// Each lens that splats are rendered through. One fisheye shows nothing in the corners.
INSTANTIATE_TEST_SUITE_P(Lenses, Sky,
                         testing::Values(SkyCase{90, 70, 67, 1, 0}, SkyCase{90, 70, 68, 1, 1},
                                         SkyCase{90, 70, 69, 1, 2}, SkyCase{90, 70, 70, 1, 3},
                                         SkyCase{90, 45, 71, 1, 4}, SkyCase{61, 47, 72, 1, 5},
                                         SkyCase{90, 70, 73, 2, 2}));
// Few texels have the sums of all pixels.
INSTANTIATE_TEST_SUITE_P(LargeSize, Sky, testing::Values(SkyCase{800, 800, 66, 20}));

/// A band shows what the whole view shows there.
TEST(SkyOfBands, IsThatOfTheView) {
    const SkyInputs s(SkyCase{40, 48, 67});
    const pipeline::SkyTexels sky(*device(), random_sky(68, 16));
    const gpu::Buffer block = camera_buffer(s.camera, rig().config());
    auto inputs = pipeline::inputs_of(block, s.camera, {});
    inputs.sky = sky.use();
    inputs.band = {.first = 16, .rows = 24, .own_begin = 8, .own_end = 16};
    GuardedFrame guarded(rig().config(), {.splats = 1, .width = 40, .height = 24, .instances = 1});
    pipeline::FrameBuffers& frame = guarded.frame;
    const std::vector<float> no_splat(12);
    frame.records.upload(std::span<const float>(no_splat));
    const pipeline::Plan plan;
    rig().run([&](gpu::Recording& recording) {
        pipeline::FramePasses{{recording, rig().cache}, plan, frame, inputs}.draw_list(1);
    });
    EXPECT_TRUE(guarded.intact());
    const reference::Raster black(40, 24, 3);
    reference::Raster all_left(40, 24, 1);
    std::fill(all_left.values.begin(), all_left.values.end(), 1.0);
    const auto expected = over_sky(black, all_left, s.camera, reference::Sky(random_sky(68, 16)), 16);
    const auto planes = frame.planes.download<float>(frame.sizes.planes / 4);
    for (int c = 0; c < 3; ++c)
        for (int y = 0; y < 24; ++y)
            for (int x = 0; x < 40; ++x)
                ASSERT_NEAR(
                    planes[size_t(c) * frame.sizes.plane_floats + size_t(y) * frame.sizes.stride + size_t(x)],
                    expected.at(x, y)[c], 1e-4);
}

struct SkySteps {
    GuardedFrame guarded{rig().config(), sky_request(16, 16)};
    pipeline::LearnedSky sky{*device(), 3};
    const SkyMap start = random_sky(72, int(pipeline::kLearnedSkySize));
    size_t floats = start.texels.size();
    std::vector<int32_t> gradients = std::vector<int32_t>(3 * floats);
    static constexpr float kRate = 0.01f;

    SkySteps() {
        Random random(71);
        for (int32_t& value : gradients) value = int32_t(1e-6 * shared::SKY_UNITS * random.normal());
        sky.values.upload(std::span<const float>(start.texels));
    }
    void step(uint32_t views, uint32_t number, uint32_t instances = 0) {
        shared::Counts counts{};
        counts.instances = instances;
        guarded.frame.counts.upload(std::span<const shared::Counts>(&counts, 1));
        sky.slots.upload(std::span<const int32_t>(gradients));
        rig().run([&](gpu::Recording& recording) {
            record_sky_update({recording, rig().cache}, sky, guarded.frame, views, kRate, number, 5);
        });
    }
    std::vector<float> texels() const { return sky.download().texels; }
};

TEST(SkyUpdate, MovesTheTexelsByTheMeanOfTheViews) {
    SkySteps s;
    reference::Sky expected(s.start);
    reference::AdamState adam(s.floats);
    for (uint32_t number = 1; number <= 3; ++number) {
        s.step(2, number);
        std::vector<double> gradient = sky_penalty_gradient(expected);
        for (size_t k = 0; k < s.floats; ++k)
            gradient[k] +=
                (double(s.gradients[k]) + double(s.gradients[s.floats + k])) / 2 / shared::SKY_UNITS;
        adam_step(expected.texels, gradient, adam, double(SkySteps::kRate), int(number));
        const auto actual = s.texels();
        size_t apart = 0;
        for (size_t k = 0; k < s.floats; ++k) apart += std::abs(actual[k] - expected.texels[k]) > 1e-4;
        EXPECT_LT(apart, s.floats / 500) << "only where the gradient is lost in rounding";
        expected = reference::Sky(s.sky.download());
    }
    const auto first = s.sky.moments1.download<float>(s.floats),
               second = s.sky.moments2.download<float>(s.floats);
    for (size_t k = 0; k < s.floats; ++k) {
        ASSERT_NEAR(first[k], adam.m[k], 1e-10) << k;
        ASSERT_NEAR(second[k], adam.v[k], 1e-17 + 1e-4 * adam.v[k]) << k;
    }
}

TEST(SkyUpdate, DropsAndCountsStepsThatAreNotFinite) {
    SkySteps s;
    const std::vector<float> bad{std::numeric_limits<float>::quiet_NaN()};
    s.sky.moments1.upload(std::span<const float>(bad), 4 * sizeof(float));
    s.step(1, 1);
    EXPECT_EQ(s.guarded.frame.read_counts().dropped_updates, 1u);
    const auto actual = s.texels();
    for (size_t k = 0; k < 9; ++k) EXPECT_EQ(actual[k] == s.start.texels[k], k == 4) << k;
}

TEST(SkyUpdate, DoesNotMoveWhereTheInstancesDidNotFit) {
    SkySteps s;
    s.step(1, 1, 6);
    EXPECT_EQ(s.texels(), s.start.texels);
    s.step(1, 1, 5);  // they just fit
    EXPECT_NE(s.texels()[0], s.start.texels[0]);
}

TEST(SkyUpdate, GivesOtherRanksWhatAViewLearns) {
    SkySteps s;
    s.step(1, 1);
    pipeline::LearnedSky received(*device(), 2);
    received.set(0, 1, s.sky.words(0, 2));
    const auto expected = s.sky.slots.download<int32_t>(s.floats, 2 * s.sky.bytes());
    EXPECT_EQ(received.slots.download<int32_t>(s.floats, received.bytes()), expected);
    EXPECT_EQ(s.sky.words(0, 2).size(), s.sky.words_of_view());
}

}  // namespace
}  // namespace ewa::test
