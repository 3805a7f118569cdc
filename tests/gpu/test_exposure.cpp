// SPDX-License-Identifier: Apache-2.0
// Affine maps of colours on the device against the CPU reference: the image the loss sees, the way back, and Adam's step.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "pipeline/appearances.h"
#include "pipeline/frame_inputs.h"
#include "pipeline/frame_passes.h"
#include "reference/loss.h"
#include "reference/training.h"

namespace ewa::test {
namespace {

constexpr uint32_t kPhotos = 3, kPhoto = 1;
constexpr float kRate = 0.01f;
constexpr double kPull = 1e-3;

reference::Exposure wide(const Exposure& exposure) {
    reference::Exposure out;
    std::copy(exposure.begin(), exposure.end(), out.begin());
    return out;
}

struct Inputs {
    pipeline::Appearances exposures;
    std::vector<Exposure> start;
    reference::Raster image, target;
    Image photo;

    Inputs(int width, int height)
        : exposures(*device(), AppearanceModel::affine, std::vector<uint32_t>(kPhotos), 1),
          image(reference::to_double(random_target(71, width, height))),
          target(reference::to_double(random_target(72, width, height))),
          photo(random_target(72, width, height)) {
        Random random(uint64_t(width * 100 + height));
        for (uint32_t p = 0; p < kPhotos; ++p) {
            Exposure e = kIdentityExposure;
            for (float& value : e) value += float(0.2 * random.normal());
            start.push_back(e);
        }
        exposures.values.upload(std::span<const Exposure>(start));
    }
};

void run(Inputs& s, pipeline::FrameBuffers& frame, uint32_t visit, uint32_t instances = 0) {
    Rig& r = rig();
    const auto planes = pack_planes(s.image, 3, frame.sizes.stride);
    frame.planes.upload(std::span<const float>(planes));
    shared::Counts counts{};
    counts.instances = instances;
    frame.counts.upload(std::span<const shared::Counts>(&counts, 1));
    const gpu::Buffer texels = pipeline::upload_photo(*device(), s.photo);
    const pipeline::CameraUse camera{nullptr, 0, uint32_t(s.image.width), uint32_t(s.image.height)};
    const pipeline::AppearanceUse use{&s.exposures, kPhoto, 0, kRate, visit};
    r.run([&](gpu::Recording& recording) {
        pipeline::FramePasses{{recording, r.cache}, {}, frame, {.camera = camera}}.loss(texels, false, &use);
    });
}

class ExposedLoss : public testing::TestWithParam<std::pair<int, int>> {};

TEST_P(ExposedLoss, GradientsAndAdamsStepMatchTheReference) {
    const auto [width, height] = GetParam();
    Inputs s(width, height);
    GuardedFrame guarded(rig().config(), {1, uint32_t(width), uint32_t(height), 1, true, false, false,
                                          AppearanceModel::affine});
    pipeline::FrameBuffers& frame = guarded.frame;

    reference::Exposure exposure = wide(s.start[kPhoto]);
    const reference::Exposure identity = wide(kIdentityExposure);
    reference::AdamState adam(12);
    std::vector<double> values(exposure.begin(), exposure.end());
    for (uint32_t visit = 1; visit <= 3; ++visit) {
        SCOPED_TRACE("visit " + std::to_string(visit));
        std::copy(values.begin(), values.end(), exposure.begin());
        const auto loss = reference::image_loss(reference::exposed(s.image, exposure), s.target);
        const auto cpu = reference::exposed_backward(s.image, exposure, loss.gradient);
        run(s, frame, visit);
        EXPECT_TRUE(guarded.intact());
        EXPECT_NEAR(frame.read_counts().l1, loss.l1, 1e-6);
        EXPECT_NEAR(frame.read_counts().ssim, loss.ssim, 2e-6);

        const auto gradient = frame.image_gradient.download<float>(frame.sizes.image_gradient / 4);
        double worst = 0, largest = 0;
        for (int c = 0; c < 3; ++c)
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const double e = cpu.image.at(x, y)[c];
                    const float a = gradient[size_t(c) * frame.sizes.plane_floats +
                                             size_t(y) * frame.sizes.stride + size_t(x)];
                    worst = std::max(worst, std::abs(a - e));
                    largest = std::max(largest, std::abs(e));
                }
        EXPECT_LT(worst, 1e-4 * largest);

        std::vector<double> by_exposure(12);
        for (size_t k = 0; k < 12; ++k)
            by_exposure[k] = cpu.exposure[k] + kPull * (exposure[k] - identity[k]);
        adam_step(values, by_exposure, adam, kRate, int(visit));
        const std::vector<Appearance> now = s.exposures.download();
        for (size_t k = 0; k < 12; ++k)
            EXPECT_NEAR(std::get<Exposure>(now[kPhoto])[k], values[k], 2e-3 * kRate) << k;
        EXPECT_EQ(now[0], Appearance(s.start[0]));  // the other images'
        EXPECT_EQ(now[2], Appearance(s.start[2]));
    }
    // The moments tell the gradient itself, where a step of Adam says little more than its sign.
    const auto m = s.exposures.moments1.download<float>(12 * kPhotos);
    double largest = 0;
    for (const double value : adam.m) largest = std::max(largest, std::abs(value));
    for (size_t k = 0; k < 12; ++k) EXPECT_NEAR(m[12 * kPhoto + k], adam.m[k], 1e-4 * largest) << k;
}

INSTANTIATE_TEST_SUITE_P(Sizes, ExposedLoss,
                         testing::Values(std::pair{1, 1}, std::pair{61, 47}, std::pair{200, 131}));
// Several parts of rows.
INSTANTIATE_TEST_SUITE_P(LargeSize, ExposedLoss, testing::Values(std::pair{300, 200}));

/// A pixel that does not count says nothing of the exposure.
TEST(Exposure, LearnsNothingFromWhatIsMasked) {
    Inputs s(40, 30);
    GuardedFrame guarded(rig().config(), {1, 40, 30, 1, true, false, true, AppearanceModel::affine});
    Image masked(40, 30, 4);  // alpha 0 everywhere
    for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 40; ++x) std::copy_n(s.photo.at(x, y), 3, masked.at(x, y));
    const shared::Counts counts{};
    guarded.frame.counts.upload(std::span<const shared::Counts>(&counts, 1));
    const auto planes = pack_planes(s.image, 3, guarded.frame.sizes.stride);
    guarded.frame.planes.upload(std::span<const float>(planes));
    const gpu::Buffer texels = pipeline::upload_photo(*device(), masked);
    const pipeline::CameraUse camera{nullptr, 0, 40, 30};
    s.exposures.values.upload(
        std::span<const Exposure>(std::vector<Exposure>(kPhotos, kIdentityExposure)));  // where nothing pulls
    const pipeline::AppearanceUse use{&s.exposures, kPhoto, 0, kRate, 1};
    Rig& r = rig();
    r.run([&](gpu::Recording& recording) {
        pipeline::FramePasses{{recording, r.cache}, {}, guarded.frame, {.camera = camera}}.loss(texels, true,
                                                                                                &use);
    });
    EXPECT_TRUE(guarded.intact());
    EXPECT_EQ(s.exposures.download()[kPhoto], Appearance(kIdentityExposure));
}

TEST(Exposure, AStepThatIsNotFiniteIsDroppedAndCounted) {
    Inputs s(16, 16);
    GuardedFrame guarded(rig().config(), {1, 16, 16, 1, true, false, false, AppearanceModel::affine});
    s.image.at(3, 3)[1] = std::numeric_limits<double>::infinity();
    run(s, guarded.frame, 1);
    EXPECT_EQ(guarded.frame.read_counts().dropped_updates, 3u);  // each row sees every channel
    EXPECT_EQ(s.exposures.download()[kPhoto], Appearance(s.start[kPhoto]));
}

TEST(Exposure, NothingMovesWhereTheInstancesDidNotFit) {
    Inputs s(16, 16);
    GuardedFrame guarded(rig().config(), {1, 16, 16, 1, true, false, false, AppearanceModel::affine});
    run(s, guarded.frame, 1, guarded.frame.instance_capacity + 1);
    EXPECT_EQ(s.exposures.download()[kPhoto], Appearance(s.start[kPhoto]));
    run(s, guarded.frame, 1, guarded.frame.instance_capacity);  // they just fit
    EXPECT_NE(s.exposures.download()[kPhoto], Appearance(s.start[kPhoto]));
}

}  // namespace
}  // namespace ewa::test
