// SPDX-License-Identifier: Apache-2.0
// The whole chain on the device against the float64 CPU reference: pictures, and gradients of the loss.
#include <gtest/gtest.h>

#include <algorithm>

#include "ewa/error.h"
#include "ewa/renderer.h"
#include "gpu/chain.h"
#include "gpu/test_device.h"
#include "support/gradient_check.h"

namespace ewa::test {
namespace {

struct ChainCase {
    SplatKind kind;
    size_t splats;
    int width, height, sh_degree;
    Footprint kernel;
    uint64_t seed;
};

void PrintTo(const ChainCase& c, std::ostream* out) {
    *out << name_of(c.kind) << " seed " << c.seed;
}

std::string chain_case_name(const testing::TestParamInfo<ChainCase>& info) {
    const ChainCase& c = info.param;
    return std::string(name_of(c.kind)) + "_" + std::to_string(c.splats) + "_" + std::to_string(c.width) +
           "x" + std::to_string(c.height) + "_sh" + std::to_string(c.sh_degree) + "_kernel" +
           std::to_string(int(c.kernel)) + "_seed" + std::to_string(c.seed);
}

void expect_same_gradient(const Gaussians& actual, const reference::Values& expected) {
    GradientTolerance tolerance;
    tolerance.cosine = 1e-6;
    tolerance.norm = 2e-4;
    tolerance.element_relative = 1e-2;
    tolerance.element_absolute = 1e-4;
    EXPECT_TRUE(splat_gradients_agree(actual, expected, tolerance));
}

class Chain : public testing::TestWithParam<ChainCase>, protected ChainScene {
  protected:
    void SetUp() override {
        const ChainCase& c = GetParam();
        ChainScene::operator=(
            chain_scene(c.seed, c.kind, c.splats, c.width, c.height, c.sh_degree, c.kernel));
    }
};

TEST_P(Chain, PictureMatchesTheReference) {
    Renderer renderer(device(), gaussians, options);
    const Rendering rendering = renderer.render(camera, true);
    const reference::Rendered cpu = reference::render(gaussians, camera, options);
    // A contribution on the 1/255 threshold may go either way in float32.
    const ImageErrors color = image_errors(rendering.color, cpu.blended.color, 1e-5);
    RecordProperty("worst", std::to_string(color.worst));
    printf("    worst %.2e, over 1e-5: %zu of %zu\n", color.worst, color.over, color.pixels);
    EXPECT_LE(color.over, color.pixels / 1000);
    EXPECT_LT(color.worst, 1.0 / 255 + 1e-5);
    EXPECT_EQ(renderer.skipped_nonfinite(), cpu.skipped_nonfinite);
}

TEST_P(Chain, GradientMatchesTheReference) {
    const LossGradient actual = loss_gradient(device(), gaussians, camera, target, options);
    const auto expected = reference::loss_gradient(gaussians, camera, target, options);
    EXPECT_NEAR(actual.loss, expected.loss, 1e-6);
    EXPECT_NEAR(actual.l1, expected.l1, 1e-6);
    EXPECT_NEAR(actual.ssim, expected.ssim, 1e-6);
    expect_same_gradient(actual.gradient, expected.gradient);
}

TEST_P(Chain, GradientOfDepthsMatchesTheReference) {
    const ChainCase& c = GetParam();
    reference::ReferenceOptions with;
    with.loss = {0.2, 0, 0, 0, 0.9};
    const Image depths = random_depths(c.seed + 3, c.width, c.height);
    with.depths = reference::to_double(depths);
    const LossGradient actual =
        loss_gradient(device(), gaussians, camera, target, options, false, with.loss, depths);
    const auto expected = reference::loss_gradient(gaussians, camera, target, options, with);
    EXPECT_NEAR(actual.depth, expected.depth, 2e-6);
    for (const auto part : {&CameraMotion::rotation, &CameraMotion::shift}) {
        const glm::dvec3 &is = actual.camera.*part, &want = expected.camera.*part;
        EXPECT_LE(glm::length(is - want), 1e-4 * glm::length(want) + 1e-7);
    }
    EXPECT_NEAR(actual.loss, expected.loss, 1e-6);
    expect_same_gradient(actual.gradient, expected.gradient);
}

std::vector<ChainCase> cases() {
    std::vector<ChainCase> all;
    uint64_t seed = 200;  // scenes without a contribution that rounding takes across the 1/255 cut
    for (const SplatKind kind :
         {SplatKind::ordinary, SplatKind::needles, SplatKind::sub_pixel, SplatKind::off_screen_and_close,
          SplatKind::opacity_extremes, SplatKind::mixed})
        for (const size_t splats : {size_t(20), size_t(600)})
            all.push_back({kind, splats, 61, 47, int(seed % 4), Footprint::peak, seed++});
    for (const Footprint kernel : {Footprint::antialias, Footprint::density})
        all.push_back({SplatKind::mixed, 300, 53, 39, 3, kernel, seed++});
    for (const auto& [w, h] : {std::pair{1, 1}, {17, 3}, {3, 17}, {200, 150}, {257, 129}})
        all.push_back({SplatKind::mixed, 400, w, h, 2, Footprint::peak, seed++});
    // Where a pixel's position has few digits left behind the point.
    for (const auto& [w, h] : {std::pair{8192, 4}, {4, 8192}})
        all.push_back({SplatKind::sub_pixel, 600, w, h, 0, Footprint::peak, seed++});
    all.push_back({SplatKind::mixed, 3000, 160, 120, 1, Footprint::peak, seed++});
    for (const size_t splats : {size_t(0), size_t(1)})
        all.push_back({SplatKind::ordinary, splats, 61, 47, 1, Footprint::peak, seed++});
    return all;
}

/// Splats that each cover every tile of a picture of 4096 x 4096 pixels, in front of the camera.
Gaussians covering_splats(size_t count) {
    Gaussians gaussians;
    gaussians.sh_degree = 0;
    gaussians.resize(count);
    for (size_t i = 0; i < count; ++i) {
        gaussians.means[3 * i + 2] = 5.0f;
        gaussians.quaternions[4 * i] = 1.0f;
        std::fill_n(&gaussians.log_scales[3 * i], 3, 12.0f);
    }
    return gaussians;
}

// 262,144 tiles each: 16,400 splats have 2^32 and 4 million instances, which 32 bits count as 4 million.
TEST(Instances, MoreThanCanBeCountedAreAnErrorAndNoPicture) {
    Camera camera;
    camera.width = camera.height = 4096;
    camera.fx = camera.fy = 3000;
    camera.cx = camera.cy = 2048;
    Renderer renderer(device(), covering_splats(16400), {});
    EXPECT_THROW(renderer.render(camera), RunError);
}

INSTANTIATE_TEST_SUITE_P(All, Chain, testing::ValuesIn(cases()), chain_case_name);

}  // namespace
}  // namespace ewa::test
