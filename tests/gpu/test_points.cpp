// SPDX-License-Identifier: Apache-2.0
// Splats drawn as spheres on the device, against the float64 CPU reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>
#include <limits>

#include "ewa/error.h"
#include "ewa/renderer.h"
#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "passes/passes.h"
#include "pipeline/backward.h"
#include "reference/training.h"
#include "shared/constants.h"
#include "support/gradient_check.h"

namespace ewa::test {
namespace {

Scene point_scene(uint64_t seed, size_t splats, SplatKind kind, int width, int height, int sh_degree = 1,
                  int nearest = 8) {
    Scene scene = random_scene(seed, splats, kind, width, height, sh_degree);
    scene.options.points = true;
    scene.options.nearest = nearest;
    return scene;
}

double worst_difference(const Image& actual, const reference::Raster& expected) {
    double worst = 0;
    for (int y = 0; y < actual.height; ++y)
        for (int x = 0; x < actual.width; ++x)
            for (int c = 0; c < actual.channels; ++c) {
                const double error = std::abs(double(actual.at(x, y)[c]) - expected.at(x, y)[c]);
                worst = std::isfinite(error) ? std::max(worst, error) : INFINITY;
            }
    return worst;
}

struct PointsCase {
    SplatKind kind;
    size_t splats;
    int width, height, sh_degree, nearest;
};

class Points : public testing::TestWithParam<PointsCase> {
  protected:
    const PointsCase& c = GetParam();
    Scene scene = point_scene(4100 + c.splats, c.splats, c.kind, c.width, c.height, c.sh_degree, c.nearest);
};

TEST_P(Points, PictureMatchesTheReference) {
    Renderer renderer(device(), scene.gaussians, scene.options);
    const Rendering rendering = renderer.render(scene.camera, true);
    const auto cpu = reference::render(scene.gaussians, scene.camera, scene.options);
    EXPECT_LT(worst_difference(rendering.color, cpu.blended.color), 1e-5);
    EXPECT_LT(worst_difference(rendering.depth, cpu.blended.depth), 2e-4);
    reference::Raster alpha = cpu.blended.transmittance;
    for (double& value : alpha.values) value = 1 - value;
    EXPECT_LT(worst_difference(rendering.alpha, alpha), 1e-5);
    EXPECT_EQ(renderer.skipped_nonfinite(), cpu.skipped_nonfinite);
    const Rendering counted = renderer.render(scene.camera, {scene.options, Drawing::count, 1});
    for (size_t i = 0; i < counted.count.pixels.size(); ++i)
        ASSERT_EQ(uint32_t(counted.count.pixels[i]), cpu.blended.blended[i]) << i;
}

TEST_P(Points, GradientMatchesTheReference) {
    const Image target = random_target(4200, c.width, c.height);
    const LossGradient actual = loss_gradient(device(), scene.gaussians, scene.camera, target, scene.options);
    const auto expected = reference::loss_gradient(scene.gaussians, scene.camera, target, scene.options);
    EXPECT_NEAR(actual.loss, expected.loss, 1e-6);
    GradientTolerance tolerance;
    tolerance.norm = 1e-4;
    tolerance.element_relative = 1e-2;
    tolerance.element_absolute = 1e-4;
    EXPECT_TRUE(splat_gradients_agree(actual.gradient, expected.gradient, tolerance));
}

INSTANTIATE_TEST_SUITE_P(All, Points,
                         testing::Values(PointsCase{SplatKind::ordinary, 20, 61, 47, 0, 8},
                                         PointsCase{SplatKind::ordinary, 600, 61, 47, 3, 8},
                                         PointsCase{SplatKind::ordinary, 601, 61, 47, 2, 1},
                                         PointsCase{SplatKind::ordinary, 602, 61, 47, 0, 1000},
                                         PointsCase{SplatKind::mixed, 300, 53, 39, 1, 3},
                                         PointsCase{SplatKind::needles, 301, 53, 39, 1, 8},
                                         PointsCase{SplatKind::sub_pixel, 302, 53, 39, 1, 8},
                                         PointsCase{SplatKind::off_screen_and_close, 303, 53, 39, 1, 8},
                                         PointsCase{SplatKind::mixed, 3000, 160, 120, 1, 8},
                                         // A pixel position has few digits left behind the point.
                                         PointsCase{SplatKind::sub_pixel, 304, 8192, 4, 0, 8},
                                         PointsCase{SplatKind::ordinary, 1, 17, 3, 1, 8}),
                         [](const testing::TestParamInfo<PointsCase>& tested) {
                             const PointsCase& c = tested.param;
                             return std::string(name_of(c.kind)) + "_" + std::to_string(c.splats) + "_" +
                                    std::to_string(c.width) + "x" + std::to_string(c.height) + "_nearest" +
                                    std::to_string(c.nearest);
                         });

/// Stiff scenes: the picture to 1e-5 of white, the gradient to 1e-4 in norm.
void expect_accurate(const Scene& scene) {
    const Rendering rendering = Renderer(device(), scene.gaussians, scene.options).render(scene.camera);
    const auto cpu = reference::render(scene.gaussians, scene.camera, scene.options);
    EXPECT_LT(worst_difference(rendering.color, cpu.blended.color), 2e-5);
    const Image target = random_target(4300, scene.camera.width, scene.camera.height);
    const auto actual = loss_gradient(device(), scene.gaussians, scene.camera, target, scene.options);
    const auto expected = reference::loss_gradient(scene.gaussians, scene.camera, target, scene.options);
    GradientTolerance tolerance;
    tolerance.element_relative = 1e-2;
    tolerance.element_absolute = 1e-4;
    EXPECT_TRUE(splat_gradients_agree(actual.gradient, expected.gradient, tolerance));
}

void scale_by(Gaussians& g, double factor) {
    for (float& s : g.log_scales) s += float(std::log(factor));
}

TEST(PointsStiff, RadiiFromTinyToHuge) {
    for (const double factor : {1e-6, 1e-3, 1e2, 1e4}) {
        SCOPED_TRACE(factor);
        Scene scene = point_scene(4310, 40, SplatKind::ordinary, 53, 39);
        scale_by(scene.gaussians, factor);
        expect_accurate(scene);
    }
}

TEST(PointsStiff, OnBothSidesOfTheNearPlane) {
    Scene scene = point_scene(4315, 40, SplatKind::ordinary, 53, 39);
    Gaussians& g = scene.gaussians;
    const Camera& camera = scene.camera;
    for (size_t i = 0; i < g.size(); ++i) {
        const glm::dvec3 view = camera.rotation * g.world_mean(i) + camera.translation;
        const double share = (i % 2 == 0 ? 0.95 : 1.05) * shared::NEAR_PLANE / view.z;
        const glm::dvec3 mean = glm::transpose(camera.rotation) * (share * view - camera.translation);
        for (int k = 0; k < 3; ++k) {
            g.means[3 * i + size_t(k)] = float(mean[k]);
            g.log_scales[3 * i + size_t(k)] += float(std::log(share));
        }
    }
    EXPECT_EQ(reference::render(g, camera, scene.options).order.size(), 20u);
    expect_accurate(scene);
}

TEST(PointsStiff, FarFromTheOrigin) {
    Scene scene = point_scene(4320, 60, SplatKind::ordinary, 53, 39);
    const glm::dvec3 place(1e7, -8e6, 300);
    scene.gaussians.origin = place;
    scene.camera.translation -= scene.camera.rotation * place;
    expect_accurate(scene);
}

TEST(PointsStiff, CoincidingAndAtEqualDepths) {
    Scene scene = point_scene(4330, 30, SplatKind::ordinary, 53, 39);
    auto& means = scene.gaussians.means;
    for (size_t i = 3; i < means.size(); ++i) means[i] = means[i % 3];
    expect_accurate(scene);
}

TEST(PointsStiff, DamagedSplatsAreSkippedAndCounted) {
    Scene scene = point_scene(4340, 60, SplatKind::ordinary, 53, 39);
    Gaussians& g = scene.gaussians;
    const float bad[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                         -std::numeric_limits<float>::infinity()};
    for (size_t k = 0; k < 3; ++k) {
        g.means[3 * k + 1] = bad[k];
        g.log_scales[3 * (k + 10) + 2] = bad[k];
        g.quaternions[4 * (k + 20)] = bad[k];
        g.opacity_logits[k + 30] = bad[k];
        g.sh[g.sh_stride() * (k + 40) + 4] = bad[k];
    }
    std::fill_n(&g.quaternions[4 * 50], 4, 0.0f);
    g.log_scales[3 * 51] = 1e30f;
    Renderer renderer(device(), g, scene.options);
    const Rendering rendering = renderer.render(scene.camera);
    const auto cpu = reference::render(g, scene.camera, scene.options);
    EXPECT_LT(worst_difference(rendering.color, cpu.blended.color), 1e-5);
    EXPECT_EQ(renderer.skipped_nonfinite(), cpu.skipped_nonfinite);
    EXPECT_GE(cpu.skipped_nonfinite, 12u);
    const Image target = random_target(4341, 53, 39);
    const Gaussians gradient = loss_gradient(device(), g, scene.camera, target, scene.options).gradient;
    for (const auto* values : {&gradient.means, &gradient.log_scales, &gradient.sh})
        for (const float value : *values) ASSERT_TRUE(std::isfinite(value));
}

TEST(PointsDrawing, ScalesAreShiftedTheDrawnCountedAndEllipsoidsStay) {
    Scene scene = point_scene(4350, 300, SplatKind::mixed, 61, 47);
    Renderer renderer(device(), scene.gaussians, scene.options);
    const Rendering half = renderer.render(scene.camera, {scene.options, Drawing::color, 0.5});
    const uint32_t drawn = renderer.splats_drawn();
    EXPECT_GT(drawn, 50u);
    EXPECT_LT(drawn, 300u);
    Gaussians smaller = scene.gaussians;
    scale_by(smaller, 0.5);
    const auto cpu = reference::render(smaller, scene.camera, scene.options);
    EXPECT_LT(worst_difference(half.color, cpu.blended.color), 1e-4);
    RenderOptions footprints = scene.options;
    footprints.points = false;
    EXPECT_EQ(renderer.render(scene.camera, {scene.options, Drawing::ellipsoids, 1}).color.pixels,
              renderer.render(scene.camera, {footprints, Drawing::ellipsoids, 1}).color.pixels);
    EXPECT_NE(renderer.render(scene.camera, {footprints, Drawing::color, 1}).color.pixels,
              renderer.render(scene.camera, {scene.options, Drawing::color, 1}).color.pixels);
}

/// One step of a training, and what it read.
struct Stepped {
    Gaussians after;
    std::vector<float> statistics;
    shared::Counts counts{};
};

Stepped take_step(const Scene& scene, const Image& target, const pipeline::PlanRequest& request,
                  const pipeline::Rates& rates, int steps = 1) {
    Rig& r = rig();
    const pipeline::Plan plan = plan_for(request);
    const uint32_t width = uint32_t(scene.camera.width), height = uint32_t(scene.camera.height);
    const pipeline::Model model =
        pipeline::upload_model(*device(), scene.gaussians, plan.moment_buffers(), true);
    const gpu::Buffer camera = camera_buffer(scene.camera, r.config());
    const gpu::Buffer photo = pipeline::upload_photo(*device(), target);
    pipeline::FrameBuffers frame;
    frame.reserve(
        *device(), r.config(),
        {.splats = model.splats, .width = width, .height = height, .instances = 60000, .gradients = true});
    const pipeline::FrameInputs inputs{.camera = {&camera, 0, width, height},
                                       .background = scene.options.background};
    for (int step = 0; step < steps; ++step)
        r.run([&](gpu::Recording& recording) {
            const pipeline::FramePasses on{{recording, r.cache}, plan, frame, inputs};
            const auto sorted = on.forward(model);
            on.loss(photo);
            on.backward(model, sorted, rates);
            frame.record_counts(recording);
        });
    return {download_model(model, model.params), model.statistics.download<float>(2 * size_t(model.splats)),
            frame.read_counts()};
}

pipeline::PlanRequest training_of(const Scene& scene) {
    return {.purpose = pipeline::Purpose::training,
            .scene_degree = scene.gaussians.sh_degree,
            .render = scene.options,
            .statistics = true};
}

constexpr pipeline::Rates kRates{
    .mean = 1e-3f, .opacity = 1e-2f, .quaternion = 2e-2f, .scale = 3e-3f, .sh0 = 4e-3f, .sh_rest = 5e-3f};

TEST(PointsUpdate, AStepIsThatOfTheReferencesAdam) {
    const Scene scene = point_scene(4400, 200, SplatKind::mixed, 61, 47, 2);
    const Image target = random_target(4401, 61, 47);
    const Stepped stepped = take_step(scene, target, training_of(scene), kRates);
    const auto cpu = reference::loss_gradient(scene.gaussians, scene.camera, target, scene.options);
    const auto check = [](const char* name, const std::vector<float>& before, const std::vector<float>& after,
                          const std::vector<double>& gradient, double rate) {
        std::vector<double> values(before.begin(), before.end());
        reference::AdamState state(values.size());
        adam_step(values, gradient, state, rate, 1);
        double largest = 0;
        for (const double g : gradient) largest = std::max(largest, std::abs(g));
        for (size_t i = 0; i < values.size(); ++i) {
            // Where the gradient is rounding alone, so is its sign, and with it the first step.
            if (gradient[i] != 0 && std::abs(gradient[i]) < 1e-4 * largest) continue;
            EXPECT_NEAR(after[i], values[i], 1e-2 * rate + 1e-6 * std::abs(values[i])) << name << ' ' << i;
        }
    };
    const Gaussians &a = scene.gaussians, &b = stepped.after;
    check("means", a.means, b.means, cpu.gradient.means, kRates.mean);
    check("log scales", a.log_scales, b.log_scales, cpu.gradient.log_scales, kRates.scale);
    EXPECT_EQ(a.quaternions, b.quaternions);
    EXPECT_EQ(a.opacity_logits, b.opacity_logits);
    const size_t stride = a.sh_stride();
    std::vector<float> sh0_before, sh0_after;
    std::vector<double> sh0_gradient;
    for (size_t i = 0; i < a.size(); ++i)
        for (size_t k = 0; k < 3; ++k) {
            sh0_before.push_back(a.sh[i * stride + k]);
            sh0_after.push_back(b.sh[i * stride + k]);
            sh0_gradient.push_back(cpu.gradient.sh[i * stride + k]);
        }
    check("sh 0", sh0_before, sh0_after, sh0_gradient, kRates.sh0);
    EXPECT_EQ(stepped.counts.dropped_updates, 0u);
}

TEST(PointsUpdate, EqualScalesStayEqual) {
    for (const bool packed : {false, true}) {
        Scene scene = point_scene(4410, 200, SplatKind::ordinary, 61, 47, 1);
        for (size_t i = 0; i < scene.gaussians.log_scales.size(); ++i)
            scene.gaussians.log_scales[i] = scene.gaussians.log_scales[i - i % 3];
        pipeline::PlanRequest request = training_of(scene);
        request.packed_moments = packed;
        const Stepped stepped = take_step(scene, random_target(4411, 61, 47), request, kRates, 5);
        const auto& scales = stepped.after.log_scales;
        EXPECT_NE(scales, scene.gaussians.log_scales);
        for (size_t i = 0; i < scales.size(); ++i) ASSERT_EQ(scales[i], scales[i - i % 3]) << packed;
    }
}

TEST(PointsUpdate, StatisticsAreTheNormsOfTheReference) {
    const Scene scene = point_scene(4420, 200, SplatKind::mixed, 61, 47, 0);
    const Image target = random_target(4421, 61, 47);
    const auto cpu = reference::loss_gradient(scene.gaussians, scene.camera, target, scene.options);
    for (const bool absolute : {false, true}) {
        pipeline::PlanRequest request = training_of(scene);
        request.absolute_gradients = absolute;
        const Stepped stepped = take_step(scene, target, request, kRates);
        reference::DensifyStatistics expected(scene.gaussians.size());
        accumulate(expected, cpu.blend.splats, cpu.in_view, scene.camera, absolute);
        const double largest = *std::max_element(expected.gradient_sum.begin(), expected.gradient_sum.end());
        EXPECT_GT(largest, 0);
        for (size_t i = 0; i < scene.gaussians.size(); ++i) {
            EXPECT_NEAR(stepped.statistics[2 * i], expected.gradient_sum[i], 1e-4 * largest) << i << absolute;
            if (expected.views[i] > 0) {
                EXPECT_EQ(stepped.statistics[2 * i + 1], 1) << i;
            }
        }
    }
}

TEST(PointsPlan, SaysWhatItSkips) {
    const Scene scene = point_scene(4430, 10, SplatKind::ordinary, 61, 47);
    const auto lines = plan_lines(scene.gaussians, scene.options);
    EXPECT_TRUE(std::ranges::any_of(
        lines, [](const PlanLine& line) { return line.what == "opacities and rotations"; }));
    for (const PlanLine& line : plan_lines(scene.gaussians, {}))
        EXPECT_NE(line.what, "opacities and rotations");
}

}  // namespace
}  // namespace ewa::test
