// SPDX-License-Identifier: Apache-2.0
// A step of several views: their lists, their gradients and Adam's step, against the CPU reference and against the passes of
// a step of one view.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "pipeline/views.h"
#include "reference/training.h"
#include "support/gradient_check.h"

namespace ewa::test {
namespace {

using namespace pipeline;

constexpr int kWidth = 61, kHeight = 47;

/// A scene seen by several cameras, each with its target.
struct SeenScene {
    Scene scene;
    std::vector<Camera> cameras;
    std::vector<Image> targets;

    SeenScene(uint64_t seed, size_t splats, size_t views, SplatKind kind = SplatKind::mixed,
              Footprint kernel = Footprint::peak, int sh_degree = 2)
        : scene(random_scene(seed, splats, kind, kWidth, kHeight, sh_degree, kernel)) {
        for (size_t v = 0; v < views; ++v) {
            Camera camera = scene.camera;
            // A step to the side, so that some splats leave the image.
            camera.translation.x += 0.3 * double(v);
            camera.fx *= 1 + 0.1 * double(v);
            cameras.push_back(camera);
            targets.push_back(random_target(seed + 7 + v, kWidth, kHeight));
        }
    }
    /// The mean of the views' gradients, in float64.
    reference::Values mean_gradient() const {
        std::vector<reference::ReferenceGradient> all;
        for (size_t v = 0; v < cameras.size(); ++v)
            all.push_back(reference::loss_gradient(scene.gaussians, cameras[v], targets[v], scene.options));
        reference::Values sum = all[0].gradient;
        const auto add = [&](auto member) {
            for (size_t v = 1; v < all.size(); ++v)
                for (size_t i = 0; i < (sum.*member).size(); ++i)
                    (sum.*member)[i] += (all[v].gradient.*member)[i];
            for (double& x : sum.*member) x /= double(all.size());
        };
        add(&reference::Values::means);
        add(&reference::Values::quaternions);
        add(&reference::Values::log_scales);
        add(&reference::Values::opacity_logits);
        add(&reference::Values::sh);
        return sum;
    }
};

/// Of which three in four pixels have one.
std::vector<float> some_depths(uint64_t seed) {
    Random random(seed + 400);
    std::vector<float> depths(size_t(kWidth) * kHeight);
    for (float& depth : depths) depth = std::max(0.0f, float(random.uniform(-2, 6)));
    return depths;
}

/// The device's step of a scene's views, whose parts are the bands of one view after those of another.
struct Step {
    uint32_t bands;
    Plan plan;
    Model model;
    FrameBuffers frame;
    ViewBuffers buffers;
    std::vector<gpu::Buffer> cameras, photos, depths;
    std::vector<uint32_t> first_indices{0};
    std::vector<std::vector<float>> renders;

    Step(const SeenScene& seen, PlanRequest request, uint32_t of_view = 1) : bands(of_view) {
        request.purpose = Purpose::training;
        request.scene_degree = request.present_degree = seen.scene.gaussians.sh_degree;
        request.render = seen.scene.options;
        plan = plan_for(request);
        model = upload_model(*device(), seen.scene.gaussians, plan.moment_buffers(), plan.statistics);
        for (size_t v = 0; v < seen.cameras.size(); ++v) {
            cameras.push_back(camera_buffer(seen.cameras[v], rig().config()));
            photos.push_back(upload_photo(*device(), seen.targets[v]));
            depths.emplace_back(*device(), "depth map", 4ull * kWidth * kHeight);
            depths.back().upload(std::span<const float>(some_depths(uint64_t(v))));
        }
        reserve(kHeight);
        buffers.reserve(*device(), model.splats, uint32_t(cameras.size()), bands, model.splats);
    }
    void reserve(uint32_t height) {
        frame.reserve(*device(), rig().config(),
                      {.splats = model.splats,
                       .width = kWidth,
                       .height = height,
                       .instances = 1 << 16,
                       .gradients = true,
                       .overlaid = true,
                       .loss = plan.loss});
    }
    FrameInputs inputs(const SeenScene& seen, size_t view_part) const {
        FrameInputs result{.camera = {&cameras[view_part / bands], 0, uint32_t(kWidth), uint32_t(kHeight)},
                           .background = seen.scene.options.background};
        if (bands > 1) result.band = band_of(rig().config(), kHeight, bands, uint32_t(view_part % bands));
        return result;
    }
    void list(const SeenScene& seen, size_t view_part, bool projected = false) {
        Rig& r = rig();
        gpu::Recording recording = r.recording();
        const FrameInputs drawn = inputs(seen, view_part);
        FramePasses{{recording, r.cache}, plan, frame, drawn}.list(model, buffers,
                                                                   {.view = uint32_t(view_part / bands),
                                                                    .list = uint32_t(view_part),
                                                                    .first_index = first_indices[view_part]},
                                                                   projected);
        frame.record_counts(recording);
        r.executor.run(recording);
        first_indices.push_back(first_indices[view_part] + frame.read_counts().scan_total);
    }
    uint32_t listed(size_t view_part) const {
        return first_indices[view_part + 1] - first_indices[view_part];
    }
    void draw(const SeenScene& seen, size_t view_part) {
        Rig& r = rig();
        const FrameInputs drawn = inputs(seen, view_part);
        if (bands > 1) reserve(drawn.band.rows);
        buffers.reserve_sums(*device(), r.executor, plan, first_indices.back());
        gpu::Recording recording = r.recording();
        recording.copy(buffers.visible, 0, frame.records, 0, 48ull * listed(view_part));
        const FramePasses on{{recording, r.cache}, plan, frame, drawn};
        const pipeline::Sorted sorted = on.draw_list(listed(view_part));
        on.loss(photos[view_part / bands], false, nullptr, false, {&depths[view_part / bands]});
        on.list_backward(listed(view_part), sorted, buffers.sums, first_indices[view_part]);
        r.executor.run(recording);
        renders.push_back(frame.planes.download<float>(frame.sizes.planes / 4));
    }
    void update(const SeenScene& seen, Rates rates) {
        Rig& r = rig();
        first_indices = {0};
        for (size_t p = 0; p < cameras.size() * bands; ++p) {
            list(seen, p);
            draw(seen, p);
        }
        rates.views = uint32_t(cameras.size());
        gpu::Recording recording = r.recording();
        recording.fill(frame.counts, 0, 0, sizeof(shared::Counts));
        FramePasses{{recording, r.cache}, plan, frame, {}}.update_views(model, buffers, batch_rates(rates),
                                                                        bands);
        r.executor.run(recording);
    }
};

Rates some_rates(uint32_t step) {
    return {.mean = 1e-3f,
            .opacity = 2e-3f,
            .quaternion = 3e-3f,
            .scale = 4e-3f,
            .sh0 = 5e-3f,
            .sh_rest = 6e-4f,
            .step = step};
}

TEST(ViewBatch, AListHasTheSplatsThatReachATileInTheirOrder) {
    const SeenScene seen(70, 700, 2, SplatKind::off_screen_and_close);
    Step step(seen, {});
    for (size_t v = 0; v < 2; ++v) {
        step.list(seen, v);
        const auto counts = step.frame.tile_counts.download<uint32_t>(700);
        const auto records = step.frame.records.download<std::array<float, 12>>(700);
        const auto visible = step.buffers.visible.download<std::array<float, 12>>(step.listed(v));
        const auto list_indices = step.buffers.list_indices.download<uint32_t>(1400);
        uint32_t next = step.first_indices[v];
        for (uint32_t i = 0; i < 700; ++i) {
            if (counts[i] == 0) {
                EXPECT_EQ(list_indices[700 * v + i], shared::NOT_LISTED);
                continue;
            }
            ASSERT_EQ(list_indices[700 * v + i], next);
            EXPECT_EQ(visible[next - step.first_indices[v]], records[i]);
            ++next;
        }
        EXPECT_EQ(next, step.first_indices[v + 1]);
        EXPECT_GT(step.listed(v), 20u);
        EXPECT_LT(step.listed(v), 680u);
    }
}

TEST(ViewBatch, AListDrawsItsView) {
    const SeenScene seen(71, 900, 2);
    Step step(seen, {});
    for (size_t v = 0; v < 2; ++v) {
        step.list(seen, v);
        step.draw(seen, v);
        gpu::Recording whole = rig().recording();
        FramePasses{{whole, rig().cache}, step.plan, step.frame, step.inputs(seen, v)}.forward(step.model);
        rig().executor.run(whole);
        EXPECT_EQ(step.frame.planes.download<float>(step.frame.sizes.planes / 4), step.renders[v]);
    }
}

struct ViewBatchCase {
    Footprint kernel;
    SplatKind kind;
    size_t views;
    uint32_t bands = 1;
};
class ViewBatchGradient : public testing::TestWithParam<ViewBatchCase> {};

TEST_P(ViewBatchGradient, IsTheMeanOfTheViews) {
    const auto& [kernel, kind, views, bands] = GetParam();
    const SeenScene seen(80 + uint64_t(kernel), 300, views, kind, kernel);
    Step step(seen, {}, bands);
    step.update(seen, some_rates(uint32_t(views)));
    // The first moment of the first step is (1 - beta^views) times the gradient.
    Gaussians moments = download_model(step.model, step.model.moments1);
    const double share = 1 - std::pow(shared::ADAM_BETA1, double(views));
    for (auto* values :
         {&moments.means, &moments.quaternions, &moments.log_scales, &moments.opacity_logits, &moments.sh})
        for (float& x : *values) x = float(x / share);
    EXPECT_TRUE(splat_gradients_agree(
        moments, seen.mean_gradient(),
        {.cosine = 1e-6, .norm = 2e-4, .element_relative = 1e-2, .element_absolute = 1e-4}));
}

INSTANTIATE_TEST_SUITE_P(ViewBatch, ViewBatchGradient,
                         testing::Values(ViewBatchCase{Footprint::peak, SplatKind::ordinary, 1},
                                         ViewBatchCase{Footprint::peak, SplatKind::mixed, 3},
                                         ViewBatchCase{Footprint::antialias, SplatKind::mixed, 2},
                                         ViewBatchCase{Footprint::density, SplatKind::ordinary, 2},
                                         ViewBatchCase{Footprint::peak, SplatKind::needles, 2},
                                         ViewBatchCase{Footprint::peak, SplatKind::mixed, 2, 2},
                                         ViewBatchCase{Footprint::antialias, SplatKind::ordinary, 1, 3},
                                         ViewBatchCase{Footprint::density, SplatKind::mixed, 2, 3}));

/// The rows that the loss of a band counts have those of the view's render.
TEST(ViewBatch, ABandDrawsItsRowsOfTheView) {
    const SeenScene seen(72, 900, 1);
    Step whole(seen, {}), cut(seen, {}, 3);
    whole.list(seen, 0);
    whole.draw(seen, 0);
    const shared::ImageLayout layout = whole.frame.sizes.image();
    uint32_t rows = 0;
    for (uint32_t b = 0; b < 3; ++b) {
        cut.list(seen, b);
        cut.draw(seen, b);
        const Band band = cut.inputs(seen, b).band;
        const uint32_t plane_floats = cut.frame.sizes.plane_floats;
        for (uint32_t y = 0; y < band.rows; ++y)
            for (uint32_t x = 0; x < kWidth; ++x)
                for (uint32_t c = 0; c < 4; ++c)
                    ASSERT_NEAR(
                        cut.renders[b][c * plane_floats + y * layout.stride + x],
                        whole.renders[0][c * layout.plane_floats + (band.first + y) * layout.stride + x],
                        2e-5);
        rows += band.own_end - band.own_begin;
    }
    EXPECT_EQ(rows, uint32_t(kHeight));
}

TEST(ViewBatch, AListOfABandHasTheSplatsThatReachIt) {
    SeenScene seen(73, 700, 2, SplatKind::off_screen_and_close);
    // Behind the camera, where the formulas have them in the same pixels.
    for (size_t i = 0; i < 100; ++i)
        for (int k = 0; k < 3; ++k) {
            float& mean = seen.scene.gaussians.means[3 * i + size_t(k)];
            mean = float(2 * seen.cameras[0].position()[k]) - mean;
        }
    Step step(seen, {}, 3);
    uint32_t elsewhere = 0;
    for (size_t p = 0; p < 6; ++p) {
        const Band band = step.inputs(seen, p).band;
        step.list(seen, p, p % 3 > 0);
        const auto keys = step.frame.depth_keys[0].download<uint32_t>(700);
        const auto counts = step.frame.tile_counts.download<uint32_t>(700);
        const auto records = step.frame.records.download<std::array<float, 12>>(700);
        const auto visible = step.buffers.visible.download<std::array<float, 12>>(step.listed(p));
        const auto list_indices = step.buffers.list_indices.download<uint32_t>(4200);
        uint32_t next = step.first_indices[p];
        for (uint32_t i = 0; i < 700; ++i) {
            const auto& record = records[i];
            // Beyond the farthest pixel that its alpha can reach.
            const double y = double(record[1]) - band.first,
                         reach =
                             std::sqrt(std::max(std::log(record[7] / shared::ALPHA_MIN), 0.0)) / record[6];
            const bool outside = y + reach < 0 || y - reach > band.rows;
            const bool across =
                y > 1 && y < band.rows - 1 && record[7] > 0.1 && record[0] > 1 && record[0] < kWidth - 1;
            elsewhere += outside && keys[i] != 0xffffffffu;
            if (counts[i] == 0) {
                EXPECT_EQ(list_indices[700 * p + i], shared::NOT_LISTED);
                EXPECT_FALSE(keys[i] != 0xffffffffu && across) << i;
                continue;
            }
            EXPECT_NE(keys[i], 0xffffffffu);
            EXPECT_FALSE(reach > 0 && y + 1.01 * reach < -2) << i;
            EXPECT_FALSE(reach > 0 && y - 1.01 * reach > band.rows + 2) << i;
            ASSERT_EQ(list_indices[700 * p + i], next);
            std::array<float, 12> copied = visible[next - step.first_indices[p]];
            const double mean = double(copied[1]) + copied[3], expected = double(record[1]) + record[3];
            EXPECT_NEAR(mean + band.first, expected, 1e-11 * (std::abs(expected) + band.first));
            EXPECT_LE(std::abs(copied[3]), 1e-7f * std::abs(copied[1]));
            copied[1] = record[1];
            copied[3] = record[3];
            EXPECT_EQ(copied, record);
            ++next;
        }
        EXPECT_EQ(next, step.first_indices[p + 1]);
        EXPECT_GT(step.listed(p), 10u);
    }
    EXPECT_GT(elsewhere, 20u);
}

/// Norms are those of the whole view's gradient, and a view counts once. A pixel of a halo has a part of its gradient in each of
/// two bands, so sums of absolute gradients may be larger.
TEST(ViewBatch, StatisticsOfBandsAreThoseOfTheirView) {
    const SeenScene seen(96, 200, 2, SplatKind::off_screen_and_close);
    for (const bool absolute : {false, true}) {
        const PlanRequest request{.render = {}, .statistics = true, .absolute_gradients = absolute};
        Step whole(seen, request), cut(seen, request, 3);
        whole.update(seen, some_rates(1));
        cut.update(seen, some_rates(1));
        const auto expected = whole.model.statistics.download<float>(400),
                   actual = cut.model.statistics.download<float>(400);
        const float largest = *std::max_element(expected.begin(), expected.end());
        for (size_t i = 0; i < 200; ++i) {
            EXPECT_GE(actual[2 * i], expected[2 * i] - 1e-4 * largest);
            EXPECT_LE(actual[2 * i], (absolute ? 1.5 : 1) * expected[2 * i] + 1e-4 * largest);
            EXPECT_EQ(actual[2 * i + 1], expected[2 * i + 1]);
        }
    }
}

TEST(ViewBatch, AStepFollowsAdamWithTheRulesOfABatch) {
    constexpr double kViews = 3;
    const SeenScene seen(90, 60, size_t(kViews), SplatKind::ordinary);
    Step step(seen, {});
    std::vector<double> m, v;
    for (uint32_t t = 1; t <= 4; ++t) {
        const bool nesterov = t > 2;
        const auto before = step.model.params.download<float>(parameter_bytes(60, 2) / 4);
        const auto old_m = step.model.moments1.download<float>(before.size());
        const auto old_v = step.model.moments2.download<float>(before.size());
        Rates asked = some_rates(uint32_t(kViews) * t);
        asked.nesterov = nesterov;
        step.update(seen, asked);
        const auto after = step.model.params.download<float>(before.size());
        const auto new_m = step.model.moments1.download<float>(before.size());
        const auto new_v = step.model.moments2.download<float>(before.size());
        const double beta1 = std::pow(0.9, kViews), beta2 = std::pow(0.999, kViews);
        const double bias1 = 1 - std::pow(beta1, t), bias2 = 1 - std::pow(beta2, t);
        size_t moved = 0;
        for (uint32_t f : {0u, 3u, 5u, 9u, 11u, 12u, 30u})
            for (size_t i = 0; i < 60; ++i) {
                const size_t at = parameter_index(step.model.planes(), f, i);
                const double g = (new_m[at] - beta1 * old_m[at]) / (1 - beta1);
                const double expected_v = beta2 * old_v[at] + (1 - beta2) * g * g;
                EXPECT_NEAR(new_v[at], expected_v, 1e-3 * expected_v + 1e-16);
                const double rates[] = {1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 5e-3, 6e-4};
                const size_t which = f == 0 ? 0 : f == 3 ? 1 : f == 5 ? 2 : f == 9 ? 3 : f < 14 ? 4 : 6;
                const double along =
                    nesterov ? beta1 * new_m[at] / (1 - std::pow(beta1, t + 1)) + (1 - beta1) * g / bias1
                             : new_m[at] / bias1;
                const double to = rates[which] * std::sqrt(kViews) * along /
                                  (std::sqrt(new_v[at] / bias2) + 1e-15 / std::sqrt(kViews));
                EXPECT_NEAR(before[at] - after[at], to, 2e-6 + 1e-4 * std::abs(to)) << f << " of splat " << i;
                moved += std::abs(to) > 1e-4;
            }
        EXPECT_GT(moved, 100u);
    }
}

TEST(ViewBatch, StatisticsAddTheNormsOfTheViewsThatSeeASplat) {
    const SeenScene seen(95, 200, 2, SplatKind::off_screen_and_close);
    for (const bool absolute : {false, true}) {
        Step both(seen, {.render = {}, .statistics = true, .absolute_gradients = absolute});
        both.update(seen, some_rates(1));
        std::vector<float> sums(400);
        for (size_t v = 0; v < 2; ++v) {
            SeenScene one = seen;
            one.cameras = {seen.cameras[v]};
            one.targets = {seen.targets[v]};
            Step alone(one, {.render = {}, .statistics = true, .absolute_gradients = absolute});
            alone.update(one, some_rates(1));
            const auto own = alone.model.statistics.download<float>(400);
            for (size_t i = 0; i < 400; ++i) sums[i] += own[i];
        }
        EXPECT_EQ(both.model.statistics.download<float>(400), sums);
        EXPECT_GT(*std::max_element(sums.begin(), sums.end()), 1.5f);
    }
}

/// Whether two buffers have the same bytes. Where shaders read storage buffers, a compiler may round the two kernels in
/// other places: then their floats are near each other.
void expect_same_floats(const gpu::Buffer& a, const gpu::Buffer& b, size_t count, double share) {
    if (device()->limits().texel_buffers) {
        EXPECT_EQ(a.download<uint32_t>(count), b.download<uint32_t>(count));
        return;
    }
    const auto x = a.download<float>(count), y = b.download<float>(count);
    float largest = 0;
    for (const float value : x)
        if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
    for (size_t i = 0; i < count; ++i) {
        const bool finite = std::isfinite(x[i]) || std::isfinite(y[i]);
        ASSERT_NEAR(finite ? x[i] : 0, finite ? y[i] : 0, share * largest);
    }
}

/// Against the kernel of a step of one view, whose bytes runs of one rank have. Packed moments go with gradients of single
/// pixels, and depths with the kernel that the other two do not have.
TEST(ViewBatch, AStepOfOneViewHasTheBytesOfTheFusedKernel) {
    for (const bool packed : {false, true})
        for (const Footprint kernel : {Footprint::peak, Footprint::antialias, Footprint::density}) {
            const SeenScene seen(100, 400, 1, SplatKind::mixed, kernel);
            const bool by_depth = kernel == Footprint::antialias;
            const PlanRequest request{.render = {},
                                      .loss = {.depth = by_depth ? 0.5 : 0},
                                      .depths = by_depth,
                                      .statistics = true,
                                      .absolute_gradients = packed,
                                      .packed_moments = packed,
                                      .regularised = true};
            Rates rates = some_rates(1);
            rates.opacity_weight = 1e-5f;
            rates.scale_weight = 2e-5f;
            Step split(seen, request), fused(seen, request);
            for (uint32_t t = 1; t <= 3; ++t) {
                rates.step = t;
                split.update(seen, rates);
                gpu::Recording recording = rig().recording();
                const FrameInputs inputs = fused.inputs(seen, 0);
                const FramePasses on{{recording, rig().cache}, fused.plan, fused.frame, inputs};
                const pipeline::Sorted sorted = on.forward(fused.model);
                on.loss(fused.photos[0], false, nullptr, false, {fused.depths.data()});
                on.backward(fused.model, sorted, rates);
                rig().executor.run(recording);
            }
            const size_t floats = parameter_bytes(400, 2) / 4;
            expect_same_floats(split.model.params, fused.model.params, floats, 1e-2);
            if (!packed) expect_same_floats(split.model.moments1, fused.model.moments1, floats, 1e-3);
            expect_same_floats(split.model.statistics, fused.model.statistics, 800, 1e-5);
        }
}

/// Each band compares its own rows of the depth maps.
TEST(ViewBatch, DepthsOfBandsAreThoseOfTheirView) {
    const SeenScene seen(97, 300, 2, SplatKind::ordinary);
    const PlanRequest request{
        .render = {}, .loss = {.l1 = 0, .ssim = 0, .depth = 1}, .depths = true, .statistics = true};
    Step whole(seen, request), cut(seen, request, 3);
    for (Step* step : {&whole, &cut}) step->update(seen, some_rates(1));
    const size_t floats = parameter_bytes(300, 2) / 4;
    const auto moved = whole.model.moments1.download<float>(floats);
    const auto by_bands = cut.model.moments1.download<float>(floats);
    EXPECT_GT(std::ranges::count_if(moved, [](float m) { return m != 0; }), 300);
    for (size_t i = 0; i < floats; ++i)
        ASSERT_NEAR(moved[i], by_bands[i], 1e-7 + 1e-3 * std::abs(moved[i])) << i;
}

TEST(ViewBatch, WhatNoViewSeesMovesByItsMomentsAlone) {
    SeenScene seen(110, 50, 2, SplatKind::ordinary);
    Step step(seen, {});
    step.update(seen, some_rates(2));
    // Behind both cameras now.
    for (Camera& camera : seen.cameras) camera.translation.z -= 1000;
    step.cameras.clear();
    for (const Camera& camera : seen.cameras) step.cameras.push_back(camera_buffer(camera, rig().config()));
    const auto m = step.model.moments1.download<float>(parameter_bytes(50, 2) / 4);
    step.first_indices = {0};
    for (size_t v = 0; v < 2; ++v) step.list(seen, v);
    EXPECT_EQ(step.first_indices.back(), 0u);
    Rates rates = some_rates(4);
    rates.views = 2;
    gpu::Recording recording = rig().recording();
    FramePasses{{recording, rig().cache}, step.plan, step.frame, {}}.update_views(step.model, step.buffers,
                                                                                  batch_rates(rates));
    rig().executor.run(recording);
    const auto after = step.model.moments1.download<float>(m.size());
    for (size_t i = 0; i < m.size(); ++i)
        ASSERT_NEAR(after[i], 0.81f * m[i], 1e-6f * std::abs(m[i]) + 1e-38f);
}

}  // namespace
}  // namespace ewa::test
