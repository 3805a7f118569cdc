// SPDX-License-Identifier: Apache-2.0
// The alpha of cut-out training images as a term of the loss, against the CPU reference.
#include <gtest/gtest.h>

#include <cmath>

#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "pipeline/backward.h"
#include "pipeline/frame_inputs.h"
#include "reference/loss.h"

namespace ewa::test {
namespace {

struct CutInputs {
    Image photo;                  // RGBA
    reference::Raster image;      // RGB and transmittance
    reference::Raster left, cut;  // transmittance and alpha
};

CutInputs random_cut(uint64_t seed, int width, int height, bool float32) {
    Random random(seed);
    CutInputs in{Image(), reference::Raster(width, height, 4), reference::Raster(width, height, 1),
                 reference::Raster(width, height, 1)};
    Image photo(width, height, 4);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            for (int k = 0; k < 3; ++k) {
                photo.at(x, y)[k] =
                    float32 ? float(random.uniform()) : float(random.integer(0, 255)) / 255.0f;
                in.image.at(x, y)[k] = random.uniform();
            }
            const float alpha = x % 3 == 0 ? 0
                                : float32  ? float(random.uniform())
                                           : float(random.integer(0, 255)) / 255.0f;
            photo.at(x, y)[3] = alpha;
            *in.cut.at(x, y) = alpha;
            // Where both are equal, the difference has no slope.
            *in.left.at(x, y) = x % 6 == 3 ? 1 : float(random.uniform());
            in.image.at(x, y)[3] = *in.left.at(x, y);
        }
    in.photo = photo;
    return in;
}

class AlphaLoss : public testing::TestWithParam<std::pair<int, int>> {};

/// Bands add up to the whole view, and the other terms are as without alpha.
TEST_P(AlphaLoss, ValueAndGradientMatchTheReference) {
    const int width = GetParam().first, height = GetParam().second;
    Rig& r = rig();
    const pipeline::Plan plan{.loss = {0.8, 0, 0.2, 0.7}};
    const uint32_t tile_rows = (uint32_t(height) + r.config().tile_height - 1) / r.config().tile_height;
    for (const bool float32 : {false, true}) {
        const CutInputs in = random_cut(uint64_t(width * 91 + height), width, height, float32);
        const gpu::Buffer texels = pipeline::upload_photo(*device(), in.photo);
        EXPECT_EQ(texels.texel() == gpu::Texel::rgba32f, float32);
        const reference::AlphaLoss cpu = reference::alpha_loss(in.left, in.cut);
        for (const uint32_t bands : {1u, tile_rows}) {
            double difference = 0;
            for (uint32_t b = 0; b < bands; ++b) {
                const pipeline::Band band = pipeline::band_of(r.config(), uint32_t(height), bands, b);
                pipeline::FrameRequest request{1, uint32_t(width), band.rows, 1, true, false};
                request.loss = plan.loss;
                GuardedFrame guarded(r.config(), request);
                pipeline::FrameBuffers& frame = guarded.frame;
                reference::Raster rows(width, int(band.rows), 4);
                for (int y = 0; y < int(band.rows); ++y)
                    for (int x = 0; x < width; ++x)
                        for (int c = 0; c < 4; ++c) rows.at(x, y)[c] = in.image.at(x, int(band.first) + y)[c];
                frame.planes.upload(std::span<const float>(pack_planes(rows, 4, frame.sizes.stride)));
                pipeline::FrameInputs inputs{{nullptr, 0, uint32_t(width), uint32_t(height)}, {1, 1, 1}};
                if (bands > 1) inputs.band = band;
                r.run([&](gpu::Recording& recording) {
                    pipeline::FramePasses{{recording, r.cache}, plan, frame, inputs}.loss(texels, false,
                                                                                          nullptr, true);
                });
                EXPECT_TRUE(guarded.intact());
                const shared::Counts counts = frame.read_counts();
                difference += counts.alpha;
                const double usual = pipeline::loss_of({0.8, 0, 0.2, 0}, counts);
                EXPECT_NEAR(pipeline::loss_of(plan.loss, counts), usual + 0.7 * counts.alpha, 1e-7);
                const auto gradient = frame.image_gradient.download<float>(frame.sizes.image_gradient / 4);
                for (uint32_t y = 0; y < band.rows; ++y)
                    for (int x = 0; x < width; ++x) {
                        const bool own = y >= band.own_begin && y < band.own_end;
                        const double expected = own ? 0.7 * *cpu.gradient.at(x, int(band.first + y)) : 0.0;
                        const size_t at = size_t(shared::PLANE_T) * frame.sizes.plane_floats +
                                          size_t(y) * frame.sizes.stride + size_t(x);
                        ASSERT_NEAR(gradient[at], expected, 1e-6 / (width * height)) << x << " " << y;
                    }
            }
            EXPECT_NEAR(difference, cpu.difference, 2e-7 + 1e-6 * cpu.difference) << bands << " bands";
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Sizes, AlphaLoss,
                         testing::Values(std::pair{1, 1}, std::pair{17, 3}, std::pair{3, 17},
                                         std::pair{61, 47}, std::pair{130, 90}),
                         [](const auto& tested) {
                             return std::to_string(tested.param.first) + "x" +
                                    std::to_string(tested.param.second);
                         });

TEST(AlphaLossOfOthers, IsZero) {
    const CutInputs in = random_cut(3, 40, 30, false);
    const pipeline::Plan plan{.loss = {0.8, 0, 0.2, 0.7}};
    pipeline::FrameRequest request{1, 40, 30, 1, true, false};
    EXPECT_EQ(sizes_for(rig().config(), request).image_gradient,
              sizes_for(rig().config(), request).target);  // no fourth plane
    request.loss = plan.loss;
    GuardedFrame guarded(rig().config(), request);
    pipeline::FrameBuffers& frame = guarded.frame;
    frame.planes.upload(std::span<const float>(pack_planes(in.image, 4, frame.sizes.stride)));
    const gpu::Buffer texels = pipeline::upload_photo(*device(), in.photo);
    rig().run([&](gpu::Recording& recording) {
        recording.fill(frame.counts, 0, 0, sizeof(shared::Counts));
        pipeline::FramePasses{{recording, rig().cache}, plan, frame, {{nullptr, 0, 40, 30}, {1, 1, 1}}}.loss(
            texels);
    });
    EXPECT_EQ(frame.read_counts().alpha, 0);
    const auto gradient = frame.image_gradient.download<float>(frame.sizes.image_gradient / 4);
    ASSERT_EQ(gradient.size(), size_t(4) * frame.sizes.plane_floats);
    for (size_t i = size_t(3) * frame.sizes.plane_floats; i < gradient.size(); ++i) ASSERT_EQ(gradient[i], 0);
}

}  // namespace
}  // namespace ewa::test
