// SPDX-License-Identifier: Apache-2.0
// Integration along rays on the device, against the float64 CPU reference: pictures, and gradients of the loss.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "ewa/error.h"
#include "ewa/renderer.h"
#include "gpu/test_device.h"
#include "reference/rays.h"
#include "reference/render.h"
#include "reference/volume.h"
#include "support/gradient_check.h"
#include "support/random_scene.h"

namespace ewa::test {
namespace {

struct RayCase {
    SplatKind kind;
    size_t splats;
    int width, height, sh_degree;
    Integrator integrator;
    int samples;
    Footprint kernel;
    uint64_t seed;
};

void PrintTo(const RayCase& c, std::ostream* out) {
    *out << name_of(c.kind) << " seed " << c.seed;
}

std::string ray_case_name(const testing::TestParamInfo<RayCase>& info) {
    const RayCase& c = info.param;
    return std::string(name_of(c.kind)) + "_" + std::to_string(c.splats) +
           (c.integrator == Integrator::ray ? "_ray" : "_march" + std::to_string(c.samples)) + "_kernel" +
           std::to_string(int(c.kernel)) + "_seed" + std::to_string(c.seed);
}

class RayChain : public testing::TestWithParam<RayCase> {
  protected:
    void SetUp() override {
        const RayCase& c = GetParam();
        camera = random_camera(c.seed, c.width, c.height);
        gaussians = random_gaussians(c.seed + 1, c.splats, c.kind, camera, c.sh_degree);
        target = random_target(c.seed + 2, c.width, c.height);
        options = {.background = {0.2f, 0.5f, 0.8f},
                   .kernel = c.kernel,
                   .integrator = c.integrator,
                   .samples = c.samples};
    }
    Camera camera;
    Gaussians gaussians;
    Image target;
    RenderOptions options;
};

/// The largest error of a pixel where no threshold decides.
double worst_color(const Image& actual, const reference::Raster& expected,
                   const std::vector<uint8_t>& excluded) {
    double worst = 0;
    for (int y = 0; y < actual.height; ++y)
        for (int x = 0; x < actual.width; ++x) {
            if (excluded[size_t(y) * size_t(actual.width) + size_t(x)]) continue;
            for (int c = 0; c < actual.channels; ++c) {
                const double e = std::abs(double(actual.at(x, y)[c]) - expected.at(x, y)[c]);
                worst = std::isfinite(e) ? std::max(worst, e) : INFINITY;
            }
        }
    return worst;
}

TEST_P(RayChain, PictureMatchesTheReference) {
    const bool depth = options.integrator == Integrator::ray;
    Renderer renderer(device(), gaussians, options);
    const Rendering rendering = renderer.render(camera, depth);
    const reference::Picture cpu = reference::render(gaussians, camera, options);
    const auto excluded = reference::Rays(gaussians, camera, options).at_threshold(2e-4);
    EXPECT_LT(std::count(excluded.begin(), excluded.end(), 1), 0.7 * double(excluded.size()) + 1);
    const double worst = worst_color(rendering.color, cpu.blended.color, excluded);
    printf("    worst %.2e\n", worst);
    // A needle's own digits decide more: it is 1000 times longer than wide, and nothing widens it.
    const bool thin = GetParam().kind == SplatKind::needles || GetParam().kind == SplatKind::mixed;
    EXPECT_LT(worst, thin ? 1e-4 : 1e-5);
    if (depth) {
        const double deepest =
            *std::max_element(cpu.blended.depth.values.begin(), cpu.blended.depth.values.end());
        EXPECT_LT(worst_color(rendering.depth, cpu.blended.depth, excluded), 2e-4 * std::max(deepest, 1.0));
    }
    EXPECT_EQ(renderer.skipped_nonfinite(), cpu.skipped_nonfinite);
}

TEST_P(RayChain, GradientMatchesTheReference) {
    const LossGradient actual = loss_gradient(device(), gaussians, camera, target, options);
    const auto expected = reference::loss_gradient(gaussians, camera, target, options);
    EXPECT_NEAR(actual.loss, expected.loss, 1e-6);
    GradientTolerance tolerance;
    tolerance.cosine = 1e-6;
    tolerance.norm = 2e-4;
    tolerance.element_relative = 1e-2;
    tolerance.element_absolute = 2e-4;
    EXPECT_TRUE(splat_gradients_agree(actual.gradient, expected.gradient, tolerance));
}

std::vector<RayCase> ray_cases() {
    std::vector<RayCase> all;
    uint64_t seed = 500;
    for (const Footprint kernel : {Footprint::peak, Footprint::density})
        for (const SplatKind kind : {SplatKind::ordinary, SplatKind::needles, SplatKind::sub_pixel,
                                     SplatKind::off_screen_and_close, SplatKind::mixed})
            for (const int samples : {0, 16}) {
                const Integrator integrator = samples > 0 ? Integrator::march : Integrator::ray;
                all.push_back({kind, 150, 45, 37, int(seed % 4), integrator, samples, kernel, seed});
                ++seed;
            }
    for (const int samples : {1, 3})
        all.push_back(
            {SplatKind::mixed, 100, 33, 21, 1, Integrator::march, samples, Footprint::peak, seed++});
    // More splats on a ray than a lane holds.
    all.push_back({SplatKind::ordinary, 1500, 24, 20, 0, Integrator::ray, 0, Footprint::peak, seed++});
    for (const size_t splats : {size_t(0), size_t(1)})
        all.push_back({SplatKind::ordinary, splats, 17, 9, 1, splats ? Integrator::ray : Integrator::march, 4,
                       Footprint::peak, seed++});
    return all;
}

/// Two round splats beside each other, at the same distance from the eye, and a camera that is turned a little.
Rendering two_beside(double turn, Integrator integrator) {
    Gaussians two;
    two.resize(2);
    for (size_t i = 0; i < 2; ++i) {
        two.means[3 * i] = i == 0 ? -0.3f : 0.3f;
        two.means[3 * i + 2] = 3;
        two.quaternions[4 * i] = 1;
        std::fill_n(&two.log_scales[3 * i], 3, std::log(0.5f));
        two.opacity_logits[i] = 3;
        two.sh[3 * i + i] = 1.5f;
    }
    Camera camera;
    camera.width = camera.height = 32;
    camera.fx = camera.fy = 32;
    camera.cx = camera.cy = 16;
    camera.rotation =
        glm::dmat3(std::cos(turn), 0, -std::sin(turn), 0, 1, 0, std::sin(turn), 0, std::cos(turn));
    const RenderOptions options{.integrator = integrator, .samples = 8};
    return Renderer(device(), two, options).render(camera);
}

TEST(RayChainScenes, ATurningCameraSeesNoSwap) {
    const auto jump = [](Integrator integrator) {
        const Image a = two_beside(-1e-4, integrator).color, b = two_beside(1e-4, integrator).color;
        double largest = 0;
        for (size_t i = 0; i < a.pixels.size(); ++i)
            largest = std::max(largest, double(std::abs(a.pixels[i] - b.pixels[i])));
        return largest;
    };
    EXPECT_GT(jump(Integrator::splat), 0.1);
    EXPECT_LT(jump(Integrator::ray), 1e-3);
    EXPECT_LT(jump(Integrator::march), 1e-3);
}

TEST(RayChainScenes, AMarchMeetsTheIntegral) {
    const Camera camera = random_camera(31, 64, 48);
    const Gaussians gaussians = random_gaussians(32, 500, SplatKind::ordinary, camera, 1);
    for (const Footprint kernel : {Footprint::peak, Footprint::density}) {
        RenderOptions options{
            .background = {0.2f, 0.5f, 0.8f}, .kernel = kernel, .integrator = Integrator::march};
        const reference::Volume volume(gaussians, camera, options);
        const auto error = [&](int samples) {
            options.samples = samples;
            const Image image = Renderer(device(), gaussians, options).render(camera).color;
            double sum = 0;
            int values = 0;
            for (int y = 2; y < 48; y += 9)
                for (int x = 3; x < 64; x += 12) {
                    const glm::dvec3 exact = volume.exact(x + 0.5, y + 0.5);
                    for (int c = 0; c < 3; ++c) sum += std::pow(image.at(x, y)[c] - exact[c], 2);
                    values += 3;
                }
            return std::sqrt(sum / values);
        };
        const double coarse = error(4), middle = error(32), fine = error(256);
        printf("    RMS %.2e, %.2e, %.2e with 4, 32, 256 samples\n", coarse, middle, fine);
        EXPECT_LT(middle, coarse / 8);
        EXPECT_LT(fine, middle);
        EXPECT_LT(fine, 1e-4);
    }
}

TEST(RayChainScenes, GradientsRepeat) {
    const Camera camera = random_camera(41, 40, 30);
    const Gaussians gaussians = random_gaussians(42, 300, SplatKind::mixed, camera, 2);
    const Image target = random_target(43, 40, 30);
    for (const Integrator integrator : {Integrator::ray, Integrator::march}) {
        const RenderOptions options{.integrator = integrator, .samples = 12};
        const Gaussians a = loss_gradient(device(), gaussians, camera, target, options).gradient;
        const Gaussians b = loss_gradient(device(), gaussians, camera, target, options).gradient;
        EXPECT_EQ(a.means, b.means);
        EXPECT_EQ(a.quaternions, b.quaternions);
        EXPECT_EQ(a.sh, b.sh);
    }
}

TEST(RayChainScenes, WhatCannotBeDrawnIsRefused) {
    const Camera camera = random_camera(51, 16, 16);
    const Gaussians gaussians = random_gaussians(52, 5, SplatKind::ordinary, camera, 0);
    const RenderOptions ray{.integrator = Integrator::ray}, march{.integrator = Integrator::march};
    RenderOptions antialiased = ray, many = march;
    antialiased.kernel = Footprint::antialias;
    many.samples = kMostSamples + 1;
    EXPECT_THROW(Renderer(device(), gaussians, antialiased), InputError);
    EXPECT_THROW(Renderer(device(), gaussians, many), InputError);
    EXPECT_THROW(Renderer(device(), gaussians, march).render(camera, true), InputError);
    EXPECT_THROW(
        Renderer(device(), gaussians, ray).render(camera, {.render = ray, .drawing = Drawing::count}),
        InputError);
    EXPECT_THROW(Renderer(device(), gaussians, ray).render(camera, {.render = ray, .splat_scale = 0.5}),
                 InputError);
}

INSTANTIATE_TEST_SUITE_P(All, RayChain, testing::ValuesIn(ray_cases()), ray_case_name);

}  // namespace
}  // namespace ewa::test
