// SPDX-License-Identifier: Apache-2.0
// Values on the very edge of a kernel's comparisons, where a broken one and a whole one part.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/random.h"
#include "ewa/renderer.h"
#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "gpu/refinement.h"
#include "passes/passes.h"
#include "reference/render.h"
#include "reference/training.h"
#include "support/image_difference.h"

namespace ewa::test {
namespace {

/// A grand total past 32 bits is told as the largest number, also where only the low halves' carry takes it
/// there.
TEST(ScanEdges, ATotalPast32BitsIsTheLargestNumber) {
    const auto instances = [](std::vector<uint32_t> totals) {
        const uint32_t blocks = uint32_t(totals.size());
        totals.push_back(kPoison);
        Rig& r = rig();
        Guarded sums("totals", totals), counts = zero_counts();
        r.run([&](gpu::Recording& recording) {
            r.cache.get<passes::ScanTotals>().record(recording, {sums, counts},
                                                     {blocks, shared::TOTAL_INSTANCES, ~0u, 0, 1}, "scan");
        });
        expect_intact({&sums, &counts});
        return counts.read<shared::Counts>()[0].instances;
    };
    EXPECT_EQ(instances({0xffff0000u, 0xffffu}), 0xffffffffu);  // just fits
    EXPECT_EQ(instances({0xffff0000u, 0xfffeu}), 0xfffffffeu);
    EXPECT_EQ(instances({0xffff0000u, 0xffffu, 1u}), 0xffffffffu);  // by the carry of the low halves
    EXPECT_EQ(instances({0x80000000u, 0x80000000u, 7u}), 0xffffffffu);
    EXPECT_EQ(instances(std::vector<uint32_t>(300, 0x10000000u)), 0xffffffffu);
}

/// The workgroups of a sort cover all keys, in rows that the device allows. None cover instances that do not fit.
TEST(ScanEdges, WorkgroupsAreThoseOfTheInstances) {
    const auto counted = [](uint32_t total, uint32_t capacity, uint32_t overflowed = 0) {
        constexpr uint32_t kKeys = 1000, kMostGroups = 7;
        shared::Counts before{};
        before.overflowed = overflowed;
        Guarded sums("totals", std::vector<uint32_t>{total, kPoison}),
            counts("counts", std::vector<shared::Counts>{before});
        Rig& r = rig();
        r.run([&](gpu::Recording& recording) {
            r.cache.get<passes::ScanTotals>().record(
                recording, {sums, counts}, {1, shared::TOTAL_INSTANCES, capacity, kKeys, kMostGroups},
                "scan");
        });
        expect_intact({&sums, &counts});
        const auto read = counts.read<shared::Counts>()[0];
        return std::vector<uint32_t>{read.sort_blocks, read.sort_groups[0], read.sort_groups[1],
                                     read.sort_groups[2]};
    };
    using Four = std::vector<uint32_t>;
    EXPECT_EQ(counted(0, 9000), (Four{0, 0, 1, 1}));
    EXPECT_EQ(counted(1, 9000), (Four{1, 1, 1, 1}));
    EXPECT_EQ(counted(1000, 9000), (Four{1, 1, 1, 1}));
    EXPECT_EQ(counted(1001, 9000), (Four{2, 2, 1, 1}));
    EXPECT_EQ(counted(7000, 9000), (Four{7, 7, 1, 1}));
    EXPECT_EQ(counted(7001, 9000), (Four{8, 4, 2, 1}));
    EXPECT_EQ(counted(9000, 9000), (Four{9, 5, 2, 1}));
    EXPECT_EQ(counted(9001, 9000), (Four{0, 0, 1, 1}));
    EXPECT_EQ(counted(1, 9000, 1), (Four{0, 0, 1, 1}));  // an earlier frame in flight did not fit
}

/// Antialiased lines of a tenth of a pixel, at each height between the rows: the sharpest footprints. Their exponentials
/// change most from pixel to pixel, and none underflows between a segment's base and a pixel that shows the line.
TEST(BlendEdges, AThinAntialiasedLineIsWholeAtEveryHeight) {
    constexpr int kWidth = 24, kHeight = 16, kParts = 8;
    constexpr float kSize = 100, kDepth = 4;
    Camera camera = random_camera(1, kWidth, kHeight);
    camera.fx = camera.fy = kSize;
    camera.cx = kWidth / 2.0, camera.cy = kHeight / 2.0;
    camera.rotation = glm::dmat3(1.0);
    camera.translation = glm::dvec3(0.0);
    RenderOptions options;
    options.kernel = Footprint::antialias;
    for (int part = 0; part < kParts * kHeight; ++part) {
        Gaussians line;
        line.sh_degree = 0;
        line.resize(1);
        const float y = float(part) / kParts - kHeight / 2.0f;
        line.means = {0, y * kDepth / kSize, kDepth};
        line.quaternions = {1, 0, 0, 0};
        const float thin = std::log(0.1f * kDepth / kSize);
        line.log_scales = {std::log(6 * kDepth / kSize), thin, thin};
        line.opacity_logits = {4};
        line.sh = {1, 1, 1};
        Renderer renderer(device(), line, options);
        const Image actual = renderer.render(camera).color;
        EXPECT_LT(largest_difference(actual, reference::render(line, camera, options).blended.color, 1), 2e-5)
            << part;
    }
}

/// What is not finite is counted wherever the splat is, in front of the camera or behind it.
TEST(ProjectEdges, PoisonBehindTheCameraIsCounted) {
    Scene scene = random_scene(42, 7, SplatKind::ordinary, 33, 21);
    scene.camera.rotation = glm::dmat3(1.0);
    scene.camera.translation = glm::dvec3(0.0);
    Gaussians& g = scene.gaussians;
    for (size_t i = 0; i < 7; ++i) g.means[3 * i + 2] = -3;
    const float nan = std::nanf("");
    std::fill_n(&g.quaternions[4 * 1], 4, 0.0f);
    g.quaternions[4 * 2 + 3] = nan;
    g.log_scales[3 * 3 + 2] = std::numeric_limits<float>::infinity();
    g.opacity_logits[4] = nan;
    g.means[3 * 5] = nan;
    Renderer renderer(device(), g, scene.options);
    renderer.render(scene.camera);
    EXPECT_EQ(renderer.skipped_nonfinite(), 5u);
}

/// The bytes are the floats, clamped and rounded: what saving the picture would make of them.
TEST(PackedPicture, IsTheFloatsRounded) {
    Scene scene = random_scene(46, 200, SplatKind::ordinary, 61, 47);
    for (float& value : scene.gaussians.sh) value *= 2;  // beyond white too
    Renderer renderer(device(), scene.gaussians, scene.options);
    DrawOptions draw;
    draw.render = scene.options;
    const Image color = renderer.render(scene.camera, draw).color;
    const std::vector<uint8_t>& bytes = renderer.render_bytes(scene.camera, draw);
    ASSERT_EQ(bytes.size(), size_t(61 * 47 * 4));
    size_t white = 0;
    for (size_t i = 0; i < size_t(61 * 47); ++i) {
        for (size_t c = 0; c < 3; ++c) {
            const float value = color.pixels[3 * i + c];
            white += value >= 1;
            ASSERT_EQ(int(bytes[4 * i + c]), int(std::clamp(value, 0.0f, 1.0f) * 255 + 0.5f)) << i;
        }
        ASSERT_EQ(bytes[4 * i + 3], 255);
    }
    EXPECT_GT(white, 10u);
}

struct Weighed {
    std::vector<uint32_t> weights, dead;
};

Weighed weigh(const Gaussians& gaussians, float dead_logit) {
    Rig& r = rig();
    const pipeline::Model model = pipeline::upload_model(*device(), gaussians, 0, false);
    Guarded weights("weights", 4ull * model.splats), dead("dead", 4ull * model.splats);
    shared::McmcPush push{};
    push.splats = model.splats;
    push.planes = model.planes();
    push.weight_scale = 1000;
    push.dead_logit = dead_logit;
    std::ranges::copy(pipeline::kEverywhere, push.region);
    r.run([&](gpu::Recording& recording) {
        r.cache.get<passes::McmcWeigh>().record(recording, {model.params, weights, dead, model.params}, push);
    });
    expect_intact({&weights, &dead});
    return {weights.read<uint32_t>(), dead.read<uint32_t>()};
}

TEST(RelocationEdges, AtTheThresholdAndWithoutARotationASplatIsDead) {
    Gaussians g = random_scene(43, 4, SplatKind::ordinary, 33, 21).gaussians;
    g.opacity_logits = {-1.5f, std::nextafter(-1.5f, 0.0f), 2, 2};
    g.quaternions[4 * 3 + 1] = std::nanf("");
    const Weighed out = weigh(g, -1.5f);
    EXPECT_EQ(out.dead, (std::vector<uint32_t>{1, 0, 0, 1}));
    EXPECT_EQ(out.weights[0], 0u);
    EXPECT_GT(out.weights[1], 0u);
    EXPECT_EQ(out.weights[3], 0u);
}

/// Where weights are small, a draw often falls on the very border between two of them; it belongs to the
/// later one.
TEST(RelocationEdges, ADrawOnABorderIsTheLaterSplats) {
    constexpr uint32_t kSplats = 300, kBlock = 16, kDraws = 4000;
    std::vector<uint32_t> weights(kSplats), prefix(kSplats), totals(kSplats / kBlock + 2);
    for (uint32_t i = 0; i < kSplats; ++i) weights[i] = i / kBlock % 3 == 1 ? 0 : i % 4 == 2 ? 0 : 1 + i % 2;
    uint32_t sum = 0;
    for (uint32_t i = 0; i < kSplats; ++i) {
        if (i % kBlock == 0) totals[i / kBlock] = sum;
        prefix[i] = sum - totals[i / kBlock];
        sum += weights[i];
    }
    Rig& r = rig();
    Guarded prefixes("prefix", prefix), bases("totals", totals), sources("sources", 4 * kDraws),
        hits("hits", std::vector<uint32_t>(kSplats, 0));
    shared::McmcPush push{};
    push.splats = kSplats;
    push.scan_block = kBlock;
    push.draws = kDraws;
    push.total = push.own_total = sum;
    push.seed[0] = 77;
    push.step = 5;
    const auto draw = [&] {
        r.run([&](gpu::Recording& recording) {
            r.cache.get<passes::McmcDraw>().record(recording, {prefixes, bases, sources, hits}, push);
        });
    };
    draw();
    expect_intact({&prefixes, &bases, &sources, &hits});
    std::vector<uint32_t> random;
    for (uint32_t d = 0; d < kDraws; ++d)
        random.push_back(core::pcg4d({d, 5, 77, shared::MCMC_DRAW_STREAM})[0]);
    EXPECT_EQ(sources.read<uint32_t>(), reference::draw_sources(weights, random));

    // Ranks before and after this one have splats too.
    push.total_before = 90;
    push.total = 90 + sum + 40;
    draw();
    weights.insert(weights.begin(), 90, 1);
    weights.insert(weights.end(), 40, 1);
    std::vector<uint32_t> expected = reference::draw_sources(weights, random);
    for (uint32_t& source : expected)
        source = source >= 90 && source < 90 + kSplats ? source - 90 : shared::NOT_LISTED;
    EXPECT_EQ(sources.read<uint32_t>(), expected);
}

/// Both moments of a source that was copied once start anew; an untouched splat keeps both.
TEST(RelocationEdges, BothMomentsOfASourceStartAnew) {
    Gaussians g = random_scene(44, 40, SplatKind::ordinary, 33, 21).gaussians;
    for (size_t i = 0; i < 40; ++i) g.opacity_logits[i] = i < 6 ? -9.0f : 1.0f;
    pipeline::Model model = pipeline::upload_model(*device(), g, 2, false);
    for (gpu::Buffer* moments : {&model.moments1, &model.moments2})
        moments->upload(std::span<const float>(std::vector<float>(moments->bytes() / 4, 0.25f)));
    pipeline::McmcRules rules;
    rules.max_splats = 40;
    rules.seed = 9;
    rules.step = 3;
    Rig& r = rig();
    GuardedFrame guarded(r.config(), {model.splats, 16, 16, 1, true, false});
    ASSERT_EQ(refine_mcmc({r.cache, r.executor, guarded.frame}, model, rules).relocated, 6u);
    const auto m1 = download_model(model, model.moments1).opacity_logits,
               m2 = download_model(model, model.moments2).opacity_logits;
    EXPECT_EQ(m1, m2);
    size_t anew = 0;
    for (const float m : m1) anew += m == 0;
    EXPECT_GE(anew, 7u);  // the six and a source at least
    EXPECT_LE(anew, 12u);
}

/// With both moments in one word, a source's word is zero, and an untouched splat keeps its own.
TEST(RelocationEdges, PackedMomentsOfASourceStartAnew) {
    Gaussians g = random_scene(44, 40, SplatKind::ordinary, 33, 21).gaussians;
    for (size_t i = 0; i < 40; ++i) g.opacity_logits[i] = i < 6 ? -9.0f : 1.0f;
    pipeline::Model model = pipeline::upload_model(*device(), g, 1, false);
    constexpr uint32_t kWord = 0xffc12345u;  // a NaN as a float
    model.moments1.upload(
        std::span<const uint32_t>(std::vector<uint32_t>(model.moments1.bytes() / 4, kWord)));
    pipeline::McmcRules rules;
    rules.max_splats = 40;
    rules.seed = 9;
    rules.step = 3;
    Rig& r = rig();
    GuardedFrame guarded(r.config(), {model.splats, 16, 16, 1, true, false});
    ASSERT_EQ(refine_mcmc({r.cache, r.executor, guarded.frame}, model, rules).relocated, 6u);
    const auto words = model.moments1.download<uint32_t>(model.moments1.bytes() / 4);
    size_t anew = 0;
    for (uint32_t i = 0; i < 40; ++i) {
        const uint32_t word = words[pipeline::parameter_index(model.planes(), shared::PARAM_OPACITY, i)];
        anew += word == 0;
        EXPECT_TRUE(word == 0 || word == kWord);
    }
    EXPECT_GE(anew, 7u);
    EXPECT_LE(anew, 12u);
}

/// A move that leaves float32 is not made, and a frame that just fitted is not repeated.
TEST(Noise, StaysFiniteAndMovesWhatJustFitted) {
    Gaussians g = random_scene(45, 2, SplatKind::ordinary, 33, 21).gaussians;
    g.opacity_logits = {-9, -9};
    std::fill_n(&g.log_scales[3], 3, 27.0f);  // with the amplitude beyond float32
    const pipeline::Model model = pipeline::upload_model(*device(), g, 0, false);
    pipeline::FrameBuffers frame;
    frame.instance_capacity = 10;
    shared::Counts counts{};
    counts.instances = 10;
    frame.reserve_counts(*device(), rig().config());
    frame.counts.upload(std::span<const shared::Counts>(&counts, 1));
    Rig& r = rig();
    r.run([&](gpu::Recording& recording) {
        record_noise({recording, r.cache}, model, frame,
                     {.amplitude = 1e20f, .max_length = 1e9f, .seed = 1, .step = 12});
    });
    const Gaussians moved = download_model(model, model.params);
    EXPECT_NE(moved.means[0], g.means[0]);
    for (size_t k = 3; k < 6; ++k) EXPECT_EQ(moved.means[k], g.means[k]);
}

}  // namespace
}  // namespace ewa::test
