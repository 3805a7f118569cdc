// SPDX-License-Identifier: Apache-2.0
// PPISP and bilateral grids on the device against the CPU reference: the image the loss sees, the way back, and Adam's
// steps.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "pipeline/appearances.h"
#include "pipeline/frame_inputs.h"
#include "pipeline/frame_passes.h"
#include "reference/appearance.h"
#include "reference/loss.h"
#include "reference/training.h"

namespace ewa::test {
namespace {

using reference::Grid;
using reference::PpispCamera;
using reference::PpispPhoto;
using shared::GRID_FLOATS;
using shared::PPISP_CAMERA_FLOATS;
using shared::PPISP_PHOTO_FLOATS;

constexpr uint32_t kShownPhoto = 1;
constexpr float kShownRate = 0.01f;
const std::vector<uint32_t> kCameraOf{1, 0, 1};

/// Appearances far from those of the start, with a render and its target.
struct ShownInputs {
    pipeline::Appearances appearances;
    std::vector<float> start;
    reference::Raster image, target;
    Image photo;

    ShownInputs(AppearanceModel model, int width, int height)
        : appearances(*device(), model, kCameraOf, 2),
          image(reference::to_double(random_target(71, width, height))),
          target(reference::to_double(random_target(72, width, height))),
          photo(random_target(72, width, height)) {
        Random random(uint64_t(width * 100 + height));
        start = values();
        const size_t values_end = model == AppearanceModel::grid ? start.size() : appearances.camera_at(2);
        for (size_t k = 0; k < values_end; ++k) start[k] += float(0.2 * random.normal());
        if (model == AppearanceModel::ppisp) {
            for (size_t k = 0; k < PPISP_PHOTO_FLOATS; ++k)
                start[values_end + k] = float(0.02 * random.normal());
            for (uint32_t camera = 0; camera < 2; ++camera) start[appearances.camera_at(camera) + 27] = 0;
        }
        appearances.values.upload(std::span<const float>(start));
    }
    std::vector<float> values() const { return appearances.values.download<float>(appearances.bytes() / 4); }
    float* photo_values(std::vector<float>& all) const { return &all[PPISP_PHOTO_FLOATS * kShownPhoto]; }
    float* camera_values(std::vector<float>& all, uint32_t camera) const {
        return &all[appearances.camera_at(camera)];
    }
};

void show(ShownInputs& s, pipeline::FrameBuffers& frame, uint32_t visit, uint32_t instances = 0) {
    Rig& r = rig();
    const auto planes = pack_planes(s.image, 3, frame.sizes.stride);
    frame.planes.upload(std::span<const float>(planes));
    shared::Counts counts{};
    counts.instances = instances;
    frame.counts.upload(std::span<const shared::Counts>(&counts, 1));
    const gpu::Buffer texels = pipeline::upload_photo(*device(), s.photo);
    const pipeline::CameraUse camera{nullptr, 0, uint32_t(s.image.width), uint32_t(s.image.height)};
    const pipeline::AppearanceUse use{&s.appearances, kShownPhoto, 0, kShownRate, visit};
    const pipeline::FrameInputs inputs{.camera = camera};
    const pipeline::Plan plan;
    r.run([&](gpu::Recording& recording) {
        const pipeline::FramePasses on{{recording, r.cache}, plan, frame, inputs};
        on.loss(texels, false, &use);
        const uint32_t photos[] = {kShownPhoto};
        record_cameras_update(on, s.appearances, frame, photos, kShownRate, frame.instance_capacity);
    });
}

pipeline::FrameRequest shown_request(AppearanceModel model, int width, int height) {
    return {.splats = 1,
            .width = uint32_t(width),
            .height = uint32_t(height),
            .instances = 1,
            .gradients = true,
            .appearance = model};
}

/// The device's dL/d(image) and loss against these.
void expect_loss(const pipeline::FrameBuffers& frame, const reference::Loss& loss,
                 const reference::Raster& expected) {
    EXPECT_NEAR(frame.read_counts().l1, loss.l1, 2e-6);
    EXPECT_NEAR(frame.read_counts().ssim, loss.ssim, 4e-6);
    const auto gradient = frame.image_gradient.download<float>(frame.sizes.image_gradient / 4);
    double largest = 0;
    for (const double value : expected.values) largest = std::max(largest, std::abs(value));
    size_t apart = 0;
    for (int c = 0; c < 3; ++c)
        for (int y = 0; y < expected.height; ++y)
            for (int x = 0; x < expected.width; ++x) {
                const size_t at = size_t(c) * frame.sizes.plane_floats + size_t(y) * frame.sizes.stride;
                apart += std::abs(double(gradient[at + size_t(x)]) - expected.at(x, y)[c]) > 2e-4 * largest;
            }
    // Where a colour is as good as the target's, or on a limit, rounding decides on the gradient.
    EXPECT_LE(apart, expected.values.size() / 20000);
}

double largest_of(const std::vector<double>& values) {
    double largest = 0;
    for (const double value : values) largest = std::max(largest, std::abs(value));
    return largest;
}

/// Adam's first moments tell the gradient itself, where a step says little more than its sign.
void expect_moments(const float* actual, const std::vector<double>& expected, double tolerance) {
    for (size_t k = 0; k < expected.size(); ++k)
        EXPECT_NEAR(double(actual[k]), expected[k], tolerance * largest_of(expected)) << k;
}

class ShownLoss : public testing::TestWithParam<std::pair<int, int>> {};

/// The gradient of a penalty, by differences: it is quadratic, or nearly linear.
template <class Values>
std::vector<double> penalty_gradient(Values values) {
    std::vector<double> gradient;
    for (double& value : values) {
        const double before = value, step = 1e-6;
        value = before + step;
        const double above = reference::ppisp_penalty(values);
        value = before - step;
        gradient.push_back((above - reference::ppisp_penalty(values)) / (2 * step));
        value = before;
    }
    return gradient;
}

TEST_P(ShownLoss, PpispsGradientsAndStepsMatchTheReference) {
    const auto [width, height] = GetParam();
    ShownInputs s(AppearanceModel::ppisp, width, height);
    GuardedFrame guarded(rig().config(), shown_request(AppearanceModel::ppisp, width, height));
    std::vector<float> values = s.start;
    reference::AdamState photo_adam(9), camera_adam(27);
    for (uint32_t visit = 1; visit <= 3; ++visit) {
        SCOPED_TRACE("visit " + std::to_string(visit));
        PpispPhoto photo, means;
        PpispCamera camera;
        std::copy_n(s.photo_values(values), 9, photo.begin());
        std::copy_n(s.camera_values(values, 2), 9, means.begin());
        std::copy_n(s.camera_values(values, kCameraOf[kShownPhoto]), 27, camera.begin());
        const auto loss = reference::image_loss(reference::ppisp(s.image, photo, camera), s.target);
        const auto cpu = reference::ppisp_backward(s.image, photo, camera, loss.gradient);
        show(s, guarded.frame, visit);
        EXPECT_TRUE(guarded.intact());
        expect_loss(guarded.frame, loss, cpu.image);

        std::vector<double> by_photo = penalty_gradient(means), by_camera = penalty_gradient(camera);
        for (size_t k = 0; k < 9; ++k) by_photo[k] += cpu.photo[k];
        for (size_t k = 0; k < 27; ++k) by_camera[k] += cpu.camera[k];
        adam_step(photo, by_photo, photo_adam, double(kShownRate), int(visit));
        adam_step(camera, by_camera, camera_adam, double(kShownRate), int(visit));
        std::vector<float> now = s.values();
        for (size_t k = 0; k < 9; ++k) EXPECT_NEAR(s.photo_values(now)[k], photo[k], 5e-3 * kShownRate) << k;
        for (size_t k = 0; k < 27; ++k)
            EXPECT_NEAR(s.camera_values(now, 0)[k], camera[k], 5e-3 * kShownRate) << k;
        EXPECT_EQ(s.camera_values(now, 0)[27], float(visit));
        for (size_t k = 0; k < 9; ++k) {
            const float mean = (now[k] + now[PPISP_PHOTO_FLOATS + k] + now[2 * PPISP_PHOTO_FLOATS + k]) / 3;
            EXPECT_NEAR(s.camera_values(now, 2)[k], mean, 1e-6f) << k;
        }
        // The other photos and the other camera.
        for (size_t k = 0; k < PPISP_PHOTO_FLOATS; ++k)
            for (const size_t at : {k, 2 * PPISP_PHOTO_FLOATS + k}) EXPECT_EQ(now[at], s.start[at]);
        for (size_t k = 0; k < PPISP_CAMERA_FLOATS; ++k)
            EXPECT_EQ(s.camera_values(now, 1)[k], s.camera_values(s.start, 1)[k]);
        values = now;
    }
    std::vector<float> moments = s.appearances.moments1.download<float>(s.appearances.bytes() / 4);
    expect_moments(s.photo_values(moments), photo_adam.m, 1e-3);
    expect_moments(s.camera_values(moments, 0), camera_adam.m, 1e-3);
}

class ShownGrid : public ShownLoss {};

TEST_P(ShownGrid, TheGridsGradientsAndStepsMatchTheReference) {
    const auto [width, height] = GetParam();
    ShownInputs s(AppearanceModel::grid, width, height);
    GuardedFrame guarded(rig().config(), shown_request(AppearanceModel::grid, width, height));
    const size_t at = size_t(GRID_FLOATS) * kShownPhoto;
    Grid values(s.start.begin() + std::ptrdiff_t(at), s.start.begin() + std::ptrdiff_t(at + GRID_FLOATS));
    const auto identity = ColorGrid::identity_cells();
    reference::AdamState adam(GRID_FLOATS);
    for (uint32_t visit = 1; visit <= 2; ++visit) {
        SCOPED_TRACE("visit " + std::to_string(visit));
        const auto loss = reference::image_loss(reference::sliced(s.image, values), s.target);
        auto cpu = reference::sliced_backward(s.image, values, loss.gradient);
        show(s, guarded.frame, visit);
        EXPECT_TRUE(guarded.intact());
        expect_loss(guarded.frame, loss, cpu.image);
        const Grid variation = reference::grid_variation_gradient(values);
        for (size_t k = 0; k < GRID_FLOATS; ++k)
            cpu.grid[k] += variation[k] + 1e-3 / 2048 * (values[k] - double(identity[k]));
        adam_step(values, cpu.grid, adam, double(kShownRate), int(visit));
        const std::vector<float> now = s.values();
        size_t apart = 0;
        for (size_t k = 0; k < GRID_FLOATS; ++k)
            apart += std::abs(double(now[at + k]) - values[k]) > 0.02 * double(kShownRate);
        EXPECT_LT(apart, GRID_FLOATS / 500) << "only where the gradient is lost in rounding";
        EXPECT_TRUE(std::equal(now.begin(), now.begin() + GRID_FLOATS, s.start.begin()));
        EXPECT_TRUE(std::equal(now.begin() + 2 * GRID_FLOATS, now.end(), s.start.begin() + 2 * GRID_FLOATS));
        for (size_t k = 0; k < GRID_FLOATS; ++k) values[k] = double(now[at + k]);
    }
    const auto moments = s.appearances.moments1.download<float>(s.appearances.bytes() / 4);
    const double largest = largest_of(adam.m);
    for (size_t k = 0; k < GRID_FLOATS; ++k)
        ASSERT_NEAR(double(moments[at + k]), adam.m[k], 1e-3 * largest) << k;
}

INSTANTIATE_TEST_SUITE_P(Sizes, ShownLoss,
                         testing::Values(std::pair{1, 1}, std::pair{61, 47}, std::pair{200, 131}));
// The pixels of a column of cells are divided into parts.
INSTANTIATE_TEST_SUITE_P(Sizes, ShownGrid,
                         testing::Values(std::pair{1, 1}, std::pair{61, 47}, std::pair{200, 131}));
INSTANTIATE_TEST_SUITE_P(LargeSize, ShownGrid, testing::Values(std::pair{700, 800}));

TEST(Appearance, MeansOfTheGradientsOfTwoViewsMoveTheirCamera) {
    ShownInputs s(AppearanceModel::ppisp, 4, 4);
    std::vector<float> slots(2 * PPISP_CAMERA_FLOATS);
    const float camera = float(s.appearances.camera_at(1));
    for (size_t k = 0; k < 27; ++k) {
        slots[k] = 2;
        slots[PPISP_CAMERA_FLOATS + k] = 4;
    }
    slots[27] = slots[PPISP_CAMERA_FLOATS + 27] = camera;
    s.appearances.slots.upload(std::span<const float>(slots));
    GuardedFrame guarded(rig().config(), shown_request(AppearanceModel::ppisp, 4, 4));
    const shared::Counts counts{};
    guarded.frame.counts.upload(std::span<const shared::Counts>(&counts, 1));
    rig().run([&](gpu::Recording& recording) {
        const uint32_t photos[] = {0, 2};
        record_cameras_update({recording, rig().cache}, s.appearances, guarded.frame, photos, kShownRate, 1);
    });
    const auto moments = s.appearances.moments1.download<float>(s.appearances.bytes() / 4);
    for (size_t k = 0; k < 27; ++k) EXPECT_NEAR(moments[size_t(camera) + k], 0.1f * 3, 0.02f);
    // Of a step in which only the second view has this camera.
    slots[27] = float(s.appearances.camera_at(0));
    s.appearances.slots.upload(std::span<const float>(slots));
    pipeline::zero(s.appearances.moments1);
    rig().run([&](gpu::Recording& recording) {
        const uint32_t photos[] = {1, 2};
        record_cameras_update({recording, rig().cache}, s.appearances, guarded.frame, photos, kShownRate, 1);
    });
    const auto later = s.appearances.moments1.download<float>(s.appearances.bytes() / 4);
    for (size_t k = 0; k < 27; ++k) {
        EXPECT_NEAR(later[size_t(camera) + k], 0.1f * 4, 0.02f);
        EXPECT_NEAR(later[s.appearances.camera_at(0) + k], 0.1f * 2, 0.02f);
    }
}

class ShownModel : public testing::TestWithParam<AppearanceModel> {};

TEST_P(ShownModel, DropsAndCountsStepsThatAreNotFinite) {
    ShownInputs s(GetParam(), 16, 16);
    GuardedFrame guarded(rig().config(), shown_request(GetParam(), 16, 16));
    s.image.at(3, 3)[1] = std::numeric_limits<double>::quiet_NaN();
    show(s, guarded.frame, 1);
    const uint32_t dropped = guarded.frame.read_counts().dropped_updates;
    if (GetParam() == AppearanceModel::ppisp)
        EXPECT_EQ(dropped,
                  9 + 10u);  // all values of the photo; of the camera, those that its green channel reaches
    else
        EXPECT_GT(dropped, 24u);
    for (const float value : s.values()) ASSERT_TRUE(std::isfinite(value));
}

TEST_P(ShownModel, DoesNotMoveWhereTheInstancesDidNotFit) {
    ShownInputs s(GetParam(), 16, 16);
    GuardedFrame guarded(rig().config(), shown_request(GetParam(), 16, 16));
    show(s, guarded.frame, 1, guarded.frame.instance_capacity + 1);
    EXPECT_EQ(s.values(), s.start);
    show(s, guarded.frame, 1, guarded.frame.instance_capacity);  // they just fit
    std::vector<float> now = s.values();
    const uint32_t own = s.appearances.layout.row_floats * kShownPhoto;
    EXPECT_NE(now[own], s.start[own]);
    if (GetParam() == AppearanceModel::ppisp) {
        EXPECT_NE(s.camera_values(now, 0)[0], s.camera_values(s.start, 0)[0]);
    }
}

TEST_P(ShownModel, GivesOtherRanksWhatAViewLearns) {
    ShownInputs s(GetParam(), 16, 16), other(GetParam(), 16, 16);
    GuardedFrame guarded(rig().config(), shown_request(GetParam(), 16, 16));
    show(s, guarded.frame, 1);
    EXPECT_NE(s.values(), other.values());
    other.appearances.set(kShownPhoto, 0, s.appearances.words(kShownPhoto, 0));
    const uint32_t floats = s.appearances.layout.row_floats;
    const auto of_photo = [&](const gpu::Buffer& buffer) {
        const auto all = buffer.download<float>(s.appearances.bytes() / 4);
        return std::vector<float>(all.begin() + floats * kShownPhoto,
                                  all.begin() + floats * (kShownPhoto + 1));
    };
    EXPECT_EQ(of_photo(s.appearances.values), of_photo(other.appearances.values));
    EXPECT_EQ(of_photo(s.appearances.moments1), of_photo(other.appearances.moments1));
    EXPECT_EQ(of_photo(s.appearances.moments2), of_photo(other.appearances.moments2));
    if (s.appearances.slots) {
        EXPECT_EQ(s.appearances.slots.download<float>(27), other.appearances.slots.download<float>(27));
    }
}

INSTANTIATE_TEST_SUITE_P(Models, ShownModel, testing::Values(AppearanceModel::ppisp, AppearanceModel::grid));

}  // namespace
}  // namespace ewa::test
