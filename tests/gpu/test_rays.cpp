// SPDX-License-Identifier: Apache-2.0
// Integration along rays on the device, against the float64 CPU reference: pictures, and gradients of the loss.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "ewa/error.h"
#include "ewa/renderer.h"
#include "gpu/chain.h"
#include "gpu/test_device.h"
#include "reference/rays.h"
#include "reference/volume.h"
#include "support/gradient_check.h"
#include "support/random_lens.h"

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
           (c.integrator == Integrator::ray        ? "_ray"
            : c.integrator == Integrator::fast_ray ? "_fast_ray"
                                                   : "_march" + std::to_string(c.samples)) +
           "_kernel" + std::to_string(int(c.kernel)) + "_seed" + std::to_string(c.seed);
}

class RayChain : public testing::TestWithParam<RayCase>, protected ChainScene {
  protected:
    void SetUp() override {
        const RayCase& c = GetParam();
        ChainScene::operator=(
            chain_scene(c.seed, c.kind, c.splats, c.width, c.height, c.sh_degree, c.kernel));
        options.integrator = c.integrator;
        if (c.samples > 0) options.samples = c.samples;
    }
    /// 1000 times longer than wide, and nothing widens them: their own digits decide more.
    static bool has_needles() {
        return GetParam().kind == SplatKind::needles || GetParam().kind == SplatKind::mixed;
    }
};

TEST_P(RayChain, PictureMatchesTheReference) {
    const bool depth = options.integrator != Integrator::march;
    Renderer renderer(device(), gaussians, options);
    const Rendering rendering = renderer.render(camera, depth);
    const reference::Rendered cpu = reference::render(gaussians, camera, options);
    const auto excluded = reference::Rays(gaussians, camera, options).at_threshold(2e-4);
    EXPECT_LT(std::count(excluded.begin(), excluded.end(), 1), 0.7 * double(excluded.size()) + 1);
    const double bound = has_needles() ? 1e-4 : 1e-5;
    const double worst = image_errors(rendering.color, cpu.blended.color, bound, excluded).worst;
    printf("    worst %.2e\n", worst);
    EXPECT_LT(worst, bound);
    if (depth) {
        const double deepest =
            *std::max_element(cpu.blended.depth.values.begin(), cpu.blended.depth.values.end());
        const double depth_bound = 2e-4 * std::max(deepest, 1.0);
        EXPECT_LT(image_errors(rendering.depth, cpu.blended.depth, depth_bound, excluded).worst, depth_bound);
    }
    EXPECT_EQ(renderer.skipped_nonfinite(), cpu.skipped_nonfinite);
}

TEST_P(RayChain, GradientMatchesTheReference) {
    const LossGradient actual = loss_gradient(device(), gaussians, camera, target, options);
    const auto expected = reference::loss_gradient(gaussians, camera, target, options);
    // exp() of a GPU differs in its last digits, so a pixel in a thousand may blend one splat more or less.
    const double others = device()->limits().cpu ? 1 : 3;
    EXPECT_NEAR(actual.loss, expected.loss, others * 1e-6);
    GradientTolerance tolerance;
    tolerance.cosine = others * 1e-6;
    tolerance.norm = others * (has_needles() ? 2e-4 : 1e-4);  // as for pictures
    tolerance.element_relative = 1e-2;
    tolerance.element_absolute = others * 2e-4;
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
    for (const SplatKind kind :
         {SplatKind::ordinary, SplatKind::needles, SplatKind::sub_pixel, SplatKind::mixed})
        for (const auto& [integrator, kernel] : {std::pair(Integrator::ray, Footprint::antialias),
                                                 std::pair(Integrator::fast_ray, Footprint::antialias),
                                                 std::pair(Integrator::fast_ray, Footprint::density)})
            all.push_back({kind, 150, 45, 37, int(seed % 4), integrator, 0, kernel, 380 + seed++});
    for (const int samples : {1, 3})
        all.push_back(
            {SplatKind::mixed, 100, 33, 21, 1, Integrator::march, samples, Footprint::peak, seed++});
    // More splats on a ray than a lane holds.
    for (const Integrator integrator : {Integrator::ray, Integrator::fast_ray})
        all.push_back({SplatKind::ordinary, 1500, 24, 20, 0, integrator, 0, Footprint::peak, seed++});
    // More than a strip lists.
    all.push_back({SplatKind::ordinary, 3000, 16, 12, 0, Integrator::march, 4, Footprint::peak, seed + 2});
    for (const size_t splats : {size_t(0), size_t(1)})
        all.push_back({SplatKind::ordinary, splats, 17, 9, 1, splats ? Integrator::ray : Integrator::march, 4,
                       Footprint::peak, seed++});
    return all;
}

/// A splat whose axes are those of the world.
struct Added {
    glm::dvec3 mean{0};
    double scale = 1, logit = 0;
    std::array<float, 3> color{};
    double thickness = 1;  // along z, in `scale`
};
void add_splat(Gaussians& to, const Added& added) {
    const size_t i = to.size();
    to.resize(i + 1);
    for (int k = 0; k < 3; ++k) {
        to.means[3 * i + size_t(k)] = float(added.mean[k]);
        to.log_scales[3 * i + size_t(k)] = float(std::log(added.scale * (k == 2 ? added.thickness : 1)));
        to.sh[3 * i + size_t(k)] = (added.color[size_t(k)] - 0.5f) / 0.28209479f;
    }
    to.quaternions[4 * i] = 1;
    to.opacity_logits[i] = float(added.logit);
}

Camera camera_ahead(int size) {
    Camera camera;
    camera.width = camera.height = size;
    camera.fx = camera.fy = size;
    camera.cx = camera.cy = 0.5 * size;
    return camera;
}

/// Two round splats beside each other, at the same distance from the eye, and a camera that is turned a little.
Rendering two_beside(double turn, Integrator integrator) {
    Gaussians two;
    for (const int side : {-1, 1})
        add_splat(two, {{0.3 * side, 0, 3}, 0.5, 3, {side < 0 ? 0.9f : 0.5f, side < 0 ? 0.5f : 0.9f, 0.5f}});
    Camera camera = camera_ahead(32);
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

// Nine tenths of the optical depth are far behind what the eye sees first. Intervals that follow the depth's mean and deviation
// would mix the first two splats, however many there are.
TEST(RayChainScenes, AMarchMeetsTheIntegralFarInFrontOfAWall) {
    const Camera camera = camera_ahead(8);
    Gaussians gaussians;
    add_splat(gaussians, {{0, 0, 1}, 0.3, 0, {1, 0, 0}, 0.05});
    add_splat(gaussians, {{0, 0, 1.03}, 0.3, 0, {0, 0, 1}, 0.05});
    for (int wall = 0; wall < 6; ++wall) add_splat(gaussians, {{0, 0, 5}, 3, 5, {0.5f, 0.5f, 0.5f}, 0.02});
    RenderOptions options{.integrator = Integrator::march, .samples = 64};
    const glm::dvec3 exact = reference::Volume(gaussians, camera, options).exact(4.5, 4.5);
    const Image image = Renderer(device(), gaussians, options).render(camera).color;
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.at(4, 4)[c], exact[c], 1e-3);
}

TEST(RayChainScenes, WhatARayMeetsInFrontOfTheNearPlaneIsNotDrawn) {
    ChainScene disc{camera_ahead(16), {}, random_target(63, 16, 16), {.integrator = Integrator::ray}};
    add_splat(disc.gaussians, {{0, 0, 0.02}, 0.05, 1, {0.9f, 0.5f, 0.2f}});
    // A disc whose plane z = 0.02 + 5 x comes before the near plane at the left of the image.
    const double half = 0.5 * std::atan(5.0);
    for (int k = 0; k < 4; ++k) disc.gaussians.quaternions[size_t(k)] = 0;
    disc.gaussians.quaternions[0] = float(std::cos(half));
    disc.gaussians.quaternions[2] = float(-std::sin(half));
    disc.gaussians.log_scales[2] = float(std::log(1e-3));
    const Image image = Renderer(device(), disc.gaussians, disc.options).render(disc.camera).color;
    const auto expected = reference::render(disc.gaussians, disc.camera, disc.options);
    const auto excluded = reference::Rays(disc.gaussians, disc.camera, disc.options).at_threshold(2e-4);
    EXPECT_LT(image_errors(image, expected.blended.color, 1e-5, excluded).worst, 1e-5);
    EXPECT_EQ(image.at(0, 8)[0], 0.0f);
    EXPECT_GT(image.at(7, 8)[0], 0.1f);
}

/// Splats that reach the plane of the eye far from the image, so that every tile lists them and no ray meets them, and some others.
ChainScene with_unmet_splats(size_t count, Integrator integrator) {
    ChainScene scene{camera_ahead(8), {}, random_target(61, 8, 8), {.integrator = integrator, .samples = 8}};
    Random random(62);
    for (size_t i = 0; i < count; ++i) add_splat(scene.gaussians, {{100, 0, 1}, 1, 0, {1, 1, 1}});
    for (int i = 0; i < 20; ++i)
        add_splat(scene.gaussians, {{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(3, 4)},
                                    0.3,
                                    0,
                                    {float(random.uniform()), float(random.uniform()), 0.5f}});
    return scene;
}

// A driver may end a loop after 65,535 turns of all loops of an invocation.
TEST(RayChainScenes, ATileOfManySplatsIsDrawn) {
    for (const Integrator integrator : {Integrator::ray, Integrator::march}) {
        const size_t count = integrator == Integrator::ray ? 80000 : 150000;
        const ChainScene many = with_unmet_splats(count, integrator);
        const Image image = Renderer(device(), many.gaussians, many.options).render(many.camera).color;
        const LossGradient actual =
            loss_gradient(device(), many.gaussians, many.camera, many.target, many.options);
        Gaussians met = many.gaussians;
        for (std::vector<float>* array :
             {&met.means, &met.quaternions, &met.log_scales, &met.opacity_logits, &met.sh})
            array->erase(array->begin(), array->end() - std::ptrdiff_t(array->size() / (count + 20) * 20));
        const auto expected = reference::loss_gradient(met, many.camera, many.target, many.options);
        EXPECT_LT(
            image_errors(image, reference::render(met, many.camera, many.options).blended.color, 1e-5).worst,
            1e-5);
        EXPECT_NEAR(actual.loss, expected.loss, 1e-6);
        const std::vector<double> means(actual.gradient.means.end() - 60, actual.gradient.means.end());
        EXPECT_TRUE(gradients_agree(means, expected.gradient.means));
    }
}

TEST(RayChainScenes, MoreSplatsThanALoopMayHaveAreAnError) {
    const ChainScene march = with_unmet_splats(400000, Integrator::march);
    EXPECT_THROW(Renderer(device(), march.gaussians, march.options).render(march.camera), RunError);
    EXPECT_THROW(loss_gradient(device(), march.gaussians, march.camera, march.target, march.options),
                 RunError);
    // A ray holds 16 of these at a time, and walks the list again for the next.
    ChainScene ray{camera_ahead(8), {}, random_target(63, 8, 8), {.integrator = Integrator::ray}};
    for (int i = 0; i < 8000; ++i) add_splat(ray.gaussians, {{0, 0, 3}, 0.5, -5, {1, 1, 1}});
    EXPECT_THROW(Renderer(device(), ray.gaussians, ray.options).render(ray.camera), RunError);
    EXPECT_THROW(loss_gradient(device(), ray.gaussians, ray.camera, ray.target, ray.options), RunError);
}

TEST(RayChainScenes, GradientsRepeat) {
    const Camera camera = random_camera(41, 40, 30);
    const Gaussians gaussians = random_gaussians(42, 300, SplatKind::mixed, camera, 2);
    const Image target = random_target(43, 40, 30);
    for (const Integrator integrator : {Integrator::ray, Integrator::fast_ray, Integrator::march}) {
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
    RenderOptions antialiased = march, many = march;
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

/// All but parallel rays, which do not meet in the eye.
std::vector<NamedCamera> cameras_of_rays(uint64_t seed, int width, int height) {
    std::vector<NamedCamera> all = random_lenses(seed, width, height);
    std::erase_if(all, [](const NamedCamera& c) { return c.camera.distortion.lens == Lens::orthographic; });
    return all;
}

class RayChainThroughALens : public testing::TestWithParam<Integrator> {};

TEST_P(RayChainThroughALens, ImagesAreTheReferences) {
    const Integrator integrator = GetParam();
    for (const Footprint kernel : {Footprint::peak, Footprint::antialias, Footprint::density})
        for (const auto& [name, camera] : cameras_of_rays(6100, 97, 61)) {
            SCOPED_TRACE(name);
            const Gaussians gaussians = gaussians_around(6101, 300, camera, 2);
            const RenderOptions options{
                .background = {0.1f, 0.3f, 0.2f}, .kernel = kernel, .integrator = integrator};
            const bool depth = integrator != Integrator::march;
            if (!depth && kernel == Footprint::antialias) continue;
            Renderer renderer(device(), gaussians, options);
            const Rendering actual = renderer.render(camera, depth);
            const reference::Rendered expected = reference::render(gaussians, camera, options);
            const auto excluded = reference::Rays(gaussians, camera, options).at_threshold(4e-4);
            EXPECT_LT(std::count(excluded.begin(), excluded.end(), 1), 0.5 * double(excluded.size()));
            EXPECT_LT(image_errors(actual.color, expected.blended.color, 2e-5, excluded).worst, 2e-5);
            if (!depth) continue;
            const double deepest =
                *std::max_element(expected.blended.depth.values.begin(), expected.blended.depth.values.end());
            EXPECT_LT(image_errors(actual.depth, expected.blended.depth, 1e-3 * deepest, excluded).worst,
                      1e-3 * deepest);
            EXPECT_EQ(renderer.skipped_nonfinite(), 0u);
        }
}

TEST_P(RayChainThroughALens, GradientsAreTheReferences) {
    for (const Footprint kernel : {Footprint::peak, Footprint::antialias, Footprint::density})
        for (const auto& [name, camera] : cameras_of_rays(6600, 41, 29)) {
            SCOPED_TRACE(name);
            if (GetParam() == Integrator::march && kernel == Footprint::antialias) continue;
            const Gaussians gaussians = gaussians_around(6601, 60, camera, 1);
            const Image target = random_target(6602, 41, 29);
            const RenderOptions options{.kernel = kernel, .integrator = GetParam()};
            const LossGradient actual = loss_gradient(device(), gaussians, camera, target, options);
            const auto expected = reference::loss_gradient(gaussians, camera, target, options);
            EXPECT_TRUE(splat_gradients_agree(actual.gradient, expected.gradient, {1e-6, 1e-3, 1e-2, 2e-4}));
        }
}

/// Large splats around the eye, the seam and the poles: no tile misses one.
TEST_P(RayChainThroughALens, LargeSplatsAreEverywhereThatTheyShow) {
    for (const auto& [name, camera] : cameras_of_rays(6800, 80, 48)) {
        SCOPED_TRACE(name);
        Gaussians gaussians = gaussians_around(6801, 60, camera, 0);
        for (float& scale : gaussians.log_scales) scale += 1.5f;
        for (float& logit : gaussians.opacity_logits) logit -= 1;
        const RenderOptions options{.integrator = GetParam()};
        const Image actual = Renderer(device(), gaussians, options).render(camera).color;
        const auto expected = reference::render(gaussians, camera, options);
        const auto excluded = reference::Rays(gaussians, camera, options).at_threshold(4e-4);
        EXPECT_LT(image_errors(actual, expected.blended.color, 2e-5, excluded).worst, 2e-5);
    }
}

INSTANTIATE_TEST_SUITE_P(All, RayChainThroughALens,
                         testing::Values(Integrator::ray, Integrator::fast_ray, Integrator::march),
                         [](const auto& each) {
                             return each.param == Integrator::ray     ? "ray"
                                    : each.param == Integrator::march ? "march"
                                                                      : "fast_ray";
                         });
INSTANTIATE_TEST_SUITE_P(All, RayChain, testing::ValuesIn(ray_cases()), ray_case_name);

}  // namespace
}  // namespace ewa::test
