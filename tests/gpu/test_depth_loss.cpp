// SPDX-License-Identifier: Apache-2.0
// Depth maps of training images as a term of the loss, against the CPU reference.
#include <gtest/gtest.h>

#include <cmath>

#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "pipeline/backward.h"
#include "pipeline/frame_inputs.h"
#include "reference/loss.h"

namespace ewa::test {
namespace {

struct DepthInputs {
    Image photo, depths;
    reference::Raster planes;     // RGB, transmittance, sum of depths
    reference::Raster left, sum;  // the last two of them
};

/// Opacities on both sides of the least one that counts. In pixels that nothing covers, the sum of depths is 0.
DepthInputs random_depth_inputs(uint64_t seed, int width, int height) {
    Random random(seed);
    DepthInputs in{random_target(seed, width, height), random_depths(seed, width, height),
                   reference::Raster(width, height, 5), reference::Raster(width, height, 1),
                   reference::Raster(width, height, 1)};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double opacity = x % 7 == 1   ? 0
                                   : x % 7 == 2 ? 0.09
                                   : x % 7 == 3 ? 0.11
                                                : random.uniform(0.2, 1);
            const float left = float(1 - opacity);
            const float sum = float(opacity * std::exp(random.uniform(0, 2.3)));
            for (int k = 0; k < 3; ++k) in.planes.at(x, y)[k] = random.uniform();
            in.planes.at(x, y)[3] = *in.left.at(x, y) = left;
            in.planes.at(x, y)[4] = *in.sum.at(x, y) = sum;
        }
    return in;
}

class DepthLoss : public testing::TestWithParam<std::pair<int, int>> {};

/// With a term of alpha, the gradients by the transmittance add up; without, they are those of the depths alone.
TEST_P(DepthLoss, ValueAndGradientMatchTheReference) {
    const int width = GetParam().first, height = GetParam().second;
    const DepthInputs in = random_depth_inputs(uint64_t(width * 91 + height), width, height);
    const gpu::Buffer texels = pipeline::upload_photo(*device(), with_alpha(in.photo, in.depths));
    gpu::Buffer depths(*device(), "depth map", 4 * in.depths.pixels.size());
    depths.upload(std::span<const float>(in.depths.pixels));
    const reference::DepthLoss cpu = reference::depth_loss(in.sum, in.left, reference::to_double(in.depths));
    for (const bool alpha : {false, true}) {
        const pipeline::Plan plan{.loss = {0.8, 0, 0.2, alpha ? 0.7 : 0, 0.6}};
        pipeline::FrameRequest request{1, uint32_t(width), uint32_t(height), 1, true, false};
        request.loss = plan.loss;
        GuardedFrame guarded(rig().config(), request);
        pipeline::FrameBuffers& frame = guarded.frame;
        frame.planes.upload(std::span<const float>(pack_planes(in.planes, 5, frame.sizes.stride)));
        const pipeline::FrameInputs inputs{{nullptr, 0, uint32_t(width), uint32_t(height)}, {1, 1, 1}};
        const auto run = [&](const gpu::Buffer* map, uint64_t counted = 0) {
            rig().run([&](gpu::Recording& recording) {
                recording.fill(frame.counts, 0, 0, sizeof(shared::Counts));
                pipeline::FramePasses{{recording, rig().cache}, plan, frame, inputs}.loss(
                    texels, false, nullptr, alpha, {map, counted});
            });
            return frame.image_gradient.download<float>(frame.sizes.image_gradient / 4);
        };
        const std::vector<float> without = run(nullptr);
        EXPECT_EQ(frame.read_counts().depth, 0);
        // A mean over half as many pixels is twice as large.
        const uint64_t pixels = uint64_t(width) * uint64_t(height), half = (pixels + 1) / 2;
        run(&depths, half);
        EXPECT_NEAR(frame.read_counts().depth, cpu.difference * double(pixels) / double(half),
                    1e-6 + 4e-6 * cpu.difference);
        const std::vector<float> gradient = run(&depths);
        EXPECT_TRUE(guarded.intact());
        const shared::Counts counts = frame.read_counts();
        EXPECT_NEAR(counts.depth, cpu.difference, 1e-6 + 2e-6 * cpu.difference);
        const double others = pipeline::loss_of({0.8, 0, 0.2, plan.loss.alpha}, counts);
        EXPECT_NEAR(pipeline::loss_of(plan.loss, counts), others + 0.6 * counts.depth, 1e-6);
        ASSERT_EQ(gradient.size(), size_t(5) * frame.sizes.plane_floats);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < int(frame.sizes.stride); ++x) {
                const size_t at = size_t(y) * frame.sizes.stride + size_t(x);
                const size_t by_left = at + size_t(shared::PLANE_T) * frame.sizes.plane_floats;
                const size_t by_sum = at + size_t(shared::PLANE_DEPTH) * frame.sizes.plane_floats;
                const bool inside = x < width;
                const double left = inside ? 0.6 * *cpu.by_left.at(x, y) : 0;
                const double sum = inside ? 0.6 * *cpu.by_sum.at(x, y) : 0;
                ASSERT_EQ(without[by_sum], 0) << x << " " << y;
                if (!alpha) {
                    ASSERT_EQ(without[by_left], 0) << x << " " << y;
                }
                ASSERT_NEAR(gradient[by_left] - without[by_left], left,
                            2e-6 * (1 + std::abs(left)) / (width * height))
                    << x << " " << y;
                ASSERT_NEAR(gradient[by_sum], sum, 1e-6 * std::abs(sum)) << x << " " << y;
            }
        for (size_t i = 0; i < size_t(3) * frame.sizes.plane_floats; ++i) ASSERT_EQ(gradient[i], without[i]);
    }
}

INSTANTIATE_TEST_SUITE_P(Sizes, DepthLoss,
                         testing::Values(std::pair{1, 1}, std::pair{17, 3}, std::pair{3, 17},
                                         std::pair{61, 47}, std::pair{130, 90}),
                         [](const auto& tested) {
                             return std::to_string(tested.param.first) + "x" +
                                    std::to_string(tested.param.second);
                         });

/// Where the loss has no depth, a training has the buffers and passes that it has without depth maps.
TEST(DepthLossOfOthers, CostsNothing) {
    pipeline::FrameRequest request{1, 40, 30, 1, true, false};
    const pipeline::Sizes without = sizes_for(rig().config(), request);
    EXPECT_EQ(without.image_planes, 4u);
    EXPECT_EQ(without.image_gradient, without.target);
    request.loss.depth = 0.1;
    const pipeline::Sizes with = sizes_for(rig().config(), request);
    EXPECT_EQ(with.image_planes, 5u);
    EXPECT_EQ(with.image_gradient, uint64_t(5) * 4 * with.plane_floats);
    pipeline::PlanRequest plan;
    plan.purpose = pipeline::Purpose::training;
    plan.loss.depth = 0.1;
    EXPECT_EQ(plan_for(plan).loss.depth, 0);
    EXPECT_EQ(plan_for(plan).drawing, Drawing::color);
    plan.depths = true;
    EXPECT_EQ(plan_for(plan).loss.depth, 0.1);
    EXPECT_TRUE(plan_for(plan).fifth_plane());
    plan.render.points = true;
    EXPECT_EQ(plan_for(plan).loss.depth, 0);
    EXPECT_FALSE(plan_for(plan).fifth_plane());
}

}  // namespace
}  // namespace ewa::test
