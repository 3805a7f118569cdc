// SPDX-License-Identifier: Apache-2.0
// 3DGS-MCMC on the device against the CPU reference: relocation, growth, noise, regularisers.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "core/random.h"
#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "gpu/refinement.h"
#include "passes/passes.h"
#include "reference/projection.h"
#include "reference/training.h"

namespace ewa::test {
namespace {

using pipeline::McmcRules;

double sigmoid(double x) {
    return 1 / (1 + std::exp(-x));
}

struct McmcStart {
    Gaussians gaussians;
    std::vector<float> moments1, moments2;
    pipeline::Model model;

    McmcStart(uint64_t seed, size_t splats, int sh_degree, double least_logit = -9) {
        gaussians =
            random_gaussians(seed, splats, SplatKind::ordinary, random_camera(seed, 64, 48), sh_degree);
        Random random(seed);
        for (float& logit : gaussians.opacity_logits) logit = float(random.uniform(least_logit, 4));
        model = pipeline::upload_model(*device(), gaussians, 2, false);
        moments1.resize(model.moments1.bytes() / 4);
        moments2.resize(moments1.size());
        for (float& m : moments1) m = float(random.normal());
        for (float& m : moments2) m = float(random.uniform(0, 1));
        model.moments1.upload(std::span<const float>(moments1));
        model.moments2.upload(std::span<const float>(moments2));
    }
};

McmcRules mcmc_rules_for(uint32_t max_splats) {
    McmcRules rules;
    rules.max_splats = max_splats;
    rules.seed = 0x123456789abcdefull;
    rules.step = 700;
    return rules;
}

pipeline::Refinement run_refine(pipeline::Model& model, const McmcRules& rules) {
    Rig& r = rig();
    GuardedFrame guarded(r.config(), {model.splats, 16, 16, 1, true, false});
    const auto result = refine_mcmc({r.cache, r.executor, guarded.frame}, model, rules);
    EXPECT_TRUE(guarded.intact());
    return result;
}

/// The integer weights, from the device: their last bit hangs on its exponential. Checked to that bit here.
std::vector<uint32_t> device_weights(const McmcStart& start, const pipeline::Region& region) {
    Rig& r = rig();
    const uint32_t n = uint32_t(start.gaussians.size());
    Guarded weights("weights", 4ull * n), dead("dead", 4ull * n);
    shared::McmcPush push{};
    push.splats = n;
    push.planes = start.model.planes();
    push.weight_scale = float(std::min(65535u, 0xffffffffu / n));
    push.dead_logit = float(std::log(0.005 / 0.995));
    std::ranges::copy(region, push.region);
    r.run([&](gpu::Recording& recording) {
        r.cache.get<passes::McmcWeigh>().record(
            recording, {start.model.params, weights, dead, start.model.moments1}, push);
    });
    expect_intact({&weights, &dead});
    const auto result = weights.read<uint32_t>(), flags = dead.read<uint32_t>();
    for (uint32_t i = 0; i < n; ++i) {
        const double logit = start.gaussians.opacity_logits[i];
        EXPECT_EQ(flags[i], logit > push.dead_logit ? 0u : 1u);
        reference::Region box;
        for (int axis = 0; axis < 3; ++axis) {
            box.low[axis] = double(region[size_t(axis)]);
            box.high[axis] = double(region[size_t(axis) + 3]);
        }
        const std::array<float, 3> mean{start.gaussians.means[3 * i], start.gaussians.means[3 * i + 1],
                                        start.gaussians.means[3 * i + 2]};
        const bool source = flags[i] == 0 && box.contains({mean[0], mean[1], mean[2]});
        EXPECT_EQ(result[i] > 0, source);
        EXPECT_NEAR(result[i], source ? std::floor(push.weight_scale * sigmoid(logit)) : 0, 1);
    }
    return result;
}

struct RelocationCase {
    size_t splats;
    int degree;
    double spread = 0;
    Footprint kernel = Footprint::peak;
    bool region = false;
};
class Relocation : public testing::TestWithParam<RelocationCase> {};

TEST_P(Relocation, WritesTheReferencesNextGeneration) {
    const auto [splats, degree, spread, kernel, region] = GetParam();
    McmcStart start(3000 + splats, splats, degree);
    McmcRules rules = mcmc_rules_for(1u << 20);
    rules.spread = spread;
    rules.kernel = kernel;
    if (region) rules.region = middle_region(start.gaussians);
    const auto weights = device_weights(start, rules.region);
    const uint32_t n = uint32_t(splats), after = uint32_t(std::floor(rules.growth * n));
    std::vector<uint32_t> dead;
    for (uint32_t i = 0; i < n; ++i)
        if (!(start.gaussians.opacity_logits[i] > float(std::log(0.005 / 0.995)))) dead.push_back(i);
    std::vector<uint32_t> random;
    for (uint32_t d = 0; d < dead.size() + after - n; ++d)
        random.push_back(core::pcg4d(
            {d, rules.step, uint32_t(rules.seed), uint32_t(rules.seed >> 32) ^ shared::MCMC_DRAW_STREAM})[0]);
    const auto drawn = reference::draw_sources(weights, random);
    std::vector<uint32_t> source(after), copies(n);
    for (uint32_t j = 0; j < n; ++j) source[j] = j;
    for (size_t d = 0; d < drawn.size(); ++d) {
        source[d < dead.size() ? dead[d] : n + uint32_t(d - dead.size())] = drawn[d];
        ++copies[drawn[d]];
    }

    const auto result = run_refine(start.model, rules);
    ASSERT_EQ(result.before, n);
    ASSERT_EQ(result.relocated, dead.size());
    ASSERT_EQ(result.after, after);
    ASSERT_EQ(start.model.splats, after);
    const Gaussians actual = download_model(start.model, start.model.params);
    const Gaussians& old = start.gaussians;
    const uint32_t planes = pipeline::parameter_planes(degree);
    const auto moments1 = start.model.moments1.download<float>(pipeline::parameter_bytes(after, degree) / 4);
    const size_t sh = old.sh_stride();
    const reference::Values wide = old;
    for (uint32_t j = 0; j < after; ++j) {
        const uint32_t s = source[j];
        const auto n3 = core::normal3(
            {j, rules.step, uint32_t(rules.seed), uint32_t(rules.seed >> 32) ^ shared::MCMC_SPREAD_STREAM});
        const glm::dvec3 mean = reference::apart(read_splat(wide, s), {n3[0], n3[1], n3[2]}, spread);
        for (size_t k = 0; k < 3; ++k) {
            if (spread == 0 || copies[s] == 0)
                ASSERT_EQ(actual.means[3 * j + k], old.means[3 * s + k]);
            else
                ASSERT_NEAR(actual.means[3 * j + k], mean[int(k)], 2e-6 * (1 + std::abs(mean[int(k)])));
        }
        for (size_t k = 0; k < 4; ++k) ASSERT_EQ(actual.quaternions[4 * j + k], old.quaternions[4 * s + k]);
        for (size_t k = 0; k < sh; ++k) ASSERT_EQ(actual.sh[sh * j + k], old.sh[sh * s + k]);
        for (uint32_t f = 0; f < 4 * planes; ++f)
            ASSERT_EQ(moments1[pipeline::parameter_index(planes, f, j)],
                      copies[s] ? 0 : start.moments1[pipeline::parameter_index(planes, f, s)]);
        if (copies[s] == 0) {
            ASSERT_EQ(actual.opacity_logits[j], old.opacity_logits[s]);
            ASSERT_EQ(actual.log_scales[3 * j], old.log_scales[3 * s]);
            continue;
        }
        auto share = reference::share_of(sigmoid(old.opacity_logits[s]), int(copies[s]) + 1);
        // Optical depths just add up.
        if (kernel == Footprint::density) share.scale_factor = 1;
        const double opacity = std::max(share.opacity, 0.005);
        // float32, and a logarithm that is good to 6.6e-7 near 1.
        ASSERT_NEAR(actual.opacity_logits[j], std::log(opacity / (1 - opacity)), 3e-4);
        for (size_t k = 0; k < 3; ++k)
            ASSERT_NEAR(actual.log_scales[3 * j + k],
                        old.log_scales[3 * s + k] + std::log(share.scale_factor), 3e-4);
    }
}

/// One splat alive among 30,000: it and its copies share what it was, each a 30,000th of its optical depth.
TEST(RelocationOfMany, ThousandsOfCopiesShareOneSplat) {
    const size_t splats = 30000;
    McmcStart start(3777, splats, 0);
    std::fill(start.gaussians.opacity_logits.begin(), start.gaussians.opacity_logits.end(), -9.0f);
    start.gaussians.opacity_logits[17] = 3.0f;
    start.model = pipeline::upload_model(*device(), start.gaussians, 2, false);
    const auto result = run_refine(start.model, mcmc_rules_for(uint32_t(splats)));
    ASSERT_EQ(result.relocated, splats - 1);
    const Gaussians actual = download_model(start.model, start.model.params);
    const auto share = reference::share_of(sigmoid(3.0), int(splats));
    for (size_t j = 0; j < splats; j += 500)
        for (size_t k = 0; k < 3; ++k)
            ASSERT_NEAR(actual.log_scales[3 * j + k],
                        start.gaussians.log_scales[3 * 17 + k] + std::log(share.scale_factor), 2e-5);
}

/// Copies of a density together absorb exactly what their source did, also one that absorbs nearly everything.
TEST(RelocationOfMany, DensitiesShareTheirMass) {
    for (const float logit : {-3.0f, 0.2f, 12.0f, 40.0f, 3000.0f}) {
        const size_t splats = 100;
        McmcStart start(3778, splats, 0);
        std::fill(start.gaussians.opacity_logits.begin(), start.gaussians.opacity_logits.end(), -20.0f);
        start.gaussians.opacity_logits[17] = logit;
        start.model = pipeline::upload_model(*device(), start.gaussians, 2, false);
        McmcRules rules = mcmc_rules_for(uint32_t(splats));
        rules.kernel = Footprint::density;
        rules.dead_opacity = 1e-4;
        ASSERT_EQ(run_refine(start.model, rules).relocated, splats - 1);
        const Gaussians actual = download_model(start.model, start.model.params);
        double sum = 0;
        for (size_t j = 0; j < splats; ++j) {
            EXPECT_EQ(actual.log_scales[3 * j], start.gaussians.log_scales[3 * 17]);
            sum += reference::softplus(actual.opacity_logits[j]);
        }
        EXPECT_NEAR(sum, reference::softplus(logit), 2e-5 * sum) << logit;
    }
}

INSTANTIATE_TEST_SUITE_P(Sizes, Relocation,
                         testing::Values(RelocationCase{3, 0}, RelocationCase{2000, 0},
                                         RelocationCase{777, 1}, RelocationCase{300, 3},
                                         RelocationCase{1000, 1, 0.8},
                                         RelocationCase{500, 1, 0.8, Footprint::density},
                                         RelocationCase{2000, 1, 0, Footprint::peak, true}));

TEST(RelocationEdges, SourcesAreDrawnInProportionToTheirOpacity) {
    McmcStart start(3100, 40, 0, -2);
    McmcRules rules = mcmc_rules_for(40 + 40000);
    rules.growth = 1001;
    run_refine(start.model, rules);
    const Gaussians after = download_model(start.model, start.model.params);
    ASSERT_EQ(after.size(), 40040u);
    std::map<float, int> by_place;
    for (size_t j = 40; j < after.size(); ++j) ++by_place[after.means[3 * j]];
    double total = 0;
    for (const float logit : start.gaussians.opacity_logits) total += sigmoid(logit);
    for (size_t i = 0; i < 40; ++i) {
        const double expected = 40000 * sigmoid(start.gaussians.opacity_logits[i]) / total;
        EXPECT_NEAR(by_place[start.gaussians.means[3 * i]], expected, 5 * std::sqrt(expected)) << i;
    }
}

TEST(RelocationEdges, TheCapHoldsAndNothingDeadOrLivingMeansNothingDone) {
    McmcStart alive(3200, 500, 0, -4);
    EXPECT_EQ(run_refine(alive.model, mcmc_rules_for(510)).after, 510u);
    EXPECT_EQ(run_refine(alive.model, mcmc_rules_for(510)).after, 510u);
    McmcStart full(3201, 500, 0, -4);
    const auto params = full.model.params.handle();
    EXPECT_EQ(run_refine(full.model, mcmc_rules_for(100)).after,
              500u);  // a start above the cap does not shrink
    EXPECT_EQ(full.model.params.handle(), params);
    McmcStart dead(3202, 500, 0);
    for (float& logit : dead.gaussians.opacity_logits) logit = -8;
    dead.model = pipeline::upload_model(*device(), dead.gaussians, 2, false);
    EXPECT_EQ(run_refine(dead.model, mcmc_rules_for(1000)).after, 500u);
}

TEST(RelocationEdges, WhatIsNotFiniteIsRelocated) {
    McmcStart start(3300, 60, 1, -3);
    start.gaussians.means[3 * 7] = std::nanf("");
    start.gaussians.log_scales[3 * 9 + 2] = std::numeric_limits<float>::infinity();
    start.gaussians.opacity_logits[11] = std::nanf("");
    start.model = pipeline::upload_model(*device(), start.gaussians, 2, false);
    const auto result = run_refine(start.model, mcmc_rules_for(60));
    EXPECT_EQ(result.relocated, 3u);
    const Gaussians after = download_model(start.model, start.model.params);
    for (const auto* values : {&after.means, &after.log_scales, &after.opacity_logits})
        for (const float value : *values) EXPECT_TRUE(std::isfinite(value));
}

TEST(Noise, MatchesTheReference) {
    for (const double least : {-9.0, -5.6}) {
        McmcStart start(3400, 1000, 0, least);
        for (size_t i = 0; i < 500; ++i) start.gaussians.opacity_logits[i] = float(-6 + 0.002 * double(i));
        start.model = pipeline::upload_model(*device(), start.gaussians, 2, false);
        Rig& r = rig();
        pipeline::FrameBuffers frame;
        frame.instance_capacity = 10;
        shared::Counts counts{};
        frame.reserve_counts(*device(), rig().config());
        frame.counts.upload(std::span<const shared::Counts>(&counts, 1));
        const uint64_t seed = 0xabcdef0123456789ull;
        r.run([&](gpu::Recording& recording) {
            record_noise({recording, r.cache}, start.model, frame,
                         {.amplitude = 5, .max_length = 1e9f, .seed = seed, .step = 12});
        });
        const Gaussians moved = download_model(start.model, start.model.params);
        const reference::Values old = start.gaussians;
        double largest = 0;
        for (size_t i = 0; i < 1000; ++i) {
            const auto n = core::normal3(
                {uint32_t(i), 12, uint32_t(seed), uint32_t(seed >> 32) ^ shared::MCMC_NOISE_STREAM});
            const glm::dvec3 by = reference::noise(read_splat(old, i), {n[0], n[1], n[2]}, 5);
            for (int k = 0; k < 3; ++k) {
                const size_t at = 3 * i + size_t(k);
                ASSERT_NEAR(moved.means[at], old.means[at] + by[k], 1e-5 * glm::length(by) + 1e-6) << i;
                largest = std::max(largest, std::abs(by[k]));
            }
        }
        EXPECT_GT(largest, 1e-3);
        EXPECT_EQ(moved.opacity_logits, start.gaussians.opacity_logits);

        counts.instances = 11;  // the frame is going to be repeated
        frame.counts.upload(std::span<const shared::Counts>(&counts, 1));
        r.run([&](gpu::Recording& recording) {
            record_noise({recording, r.cache}, start.model, frame,
                         {.amplitude = 5, .max_length = 1e9f, .seed = seed, .step = 13});
        });
        EXPECT_EQ(download_model(start.model, start.model.params).means, moved.means);
    }
}

/// Along each axis of the splat the noise is `reach` at most, in the direction that it has; such are counted.
TEST(Noise, IsNoLongerThanItsReach) {
    McmcStart start(3500, 400, 0, -9.0);
    for (float& logit : start.gaussians.opacity_logits) logit = -8;
    start.model = pipeline::upload_model(*device(), start.gaussians, 2, false);
    Rig& r = rig();
    pipeline::FrameBuffers frame;
    frame.instance_capacity = 10;
    const shared::Counts counts{};
    frame.reserve_counts(*device(), rig().config());
    frame.counts.upload(std::span<const shared::Counts>(&counts, 1));
    const double reach = 0.1;
    r.run([&](gpu::Recording& recording) {
        record_noise({recording, r.cache}, start.model, frame,
                     {.amplitude = 5, .max_length = float(reach), .seed = 77, .step = 12});
    });
    const Gaussians moved = download_model(start.model, start.model.params);
    const reference::Values old = start.gaussians;
    uint32_t limited = 0;
    for (size_t i = 0; i < old.size(); ++i) {
        const auto n = core::normal3({uint32_t(i), 12, 77, shared::MCMC_NOISE_STREAM});
        const reference::Splat splat = read_splat(old, i);
        glm::dvec3 by = reference::noise(splat, {n[0], n[1], n[2]}, 5);
        std::array<double, 4> unit = splat.quaternion;
        const double norm = reference::robust_norm(unit);
        for (double& q : unit) q /= norm;
        const glm::dvec3 along = glm::transpose(reference::rotation_matrix(unit)) * by;
        const double longest = std::max({std::abs(along.x), std::abs(along.y), std::abs(along.z)});
        if (longest > reach) {
            by *= reach / longest;
            ++limited;
        }
        for (int k = 0; k < 3; ++k)
            ASSERT_NEAR(moved.means[3 * i + size_t(k)], old.means[3 * i + size_t(k)] + by[k], 1e-6) << i;
    }
    EXPECT_GT(limited, 50u);
    EXPECT_LT(limited, 350u);
    EXPECT_EQ(frame.counts.download<shared::Counts>(1)[0].limited_steps, limited);
}

}  // namespace
}  // namespace ewa::test
