// SPDX-License-Identifier: Apache-2.0
// Frozen splats in refinements, in the noise and in the opacity reset. test_update.cpp has the update.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "gpu/refinement.h"

namespace ewa::test {
namespace {

/// A scene in which every third splat is frozen, and every other splat is nearly transparent.
struct FrozenScene {
    static constexpr uint32_t kSplats = 200;
    Gaussians gaussians;
    pipeline::Model model;

    FrozenScene() {
        gaussians = random_gaussians(61, kSplats, SplatKind::ordinary, random_camera(61, 64, 48), 1);
        for (size_t i = 0; i < kSplats; ++i) gaussians.opacity_logits[i] = i % 2 == 0 ? -9.0f : 1.0f;
        model = pipeline::upload_model(*device(), gaussians, 2, true);
        std::vector<uint32_t> words(model.moments1.bytes() / 4, 0x3f000000u);
        for (uint32_t f = 0; f < 4 * model.planes(); ++f)
            for (size_t i = 0; i < kSplats; i += 3)
                words[pipeline::parameter_index(model.planes(), f, i)] = shared::FROZEN_MOMENT;
        model.moments1.upload(std::span<const uint32_t>(words));
        model.moments2.upload(std::span<const uint32_t>(words));
    }
    static bool frozen(size_t i) { return i % 3 == 0; }
    /// Splat `now` of the model is frozen and has the values of splat i.
    void expect_frozen(const Gaussians& after, uint32_t now, uint32_t i) const {
        for (size_t k = 0; k < 3; ++k) {
            EXPECT_EQ(after.means[3 * now + k], gaussians.means[3 * i + k]);
            EXPECT_EQ(after.log_scales[3 * now + k], gaussians.log_scales[3 * i + k]);
        }
        EXPECT_EQ(after.opacity_logits[now], gaussians.opacity_logits[i]);
        EXPECT_EQ(after.sh[after.sh_stride() * now], gaussians.sh[gaussians.sh_stride() * i]);
    }
    /// For each splat of the model, whether all of its moments are those of a frozen one.
    std::vector<bool> marks() const {
        std::vector<bool> all(model.splats, true);
        for (const gpu::Buffer* buffer : {&model.moments1, &model.moments2}) {
            const auto words = buffer->download<uint32_t>(pipeline::parameter_bytes(model.splats, 1) / 4);
            for (uint32_t f = 0; f < 4 * model.planes(); ++f)
                for (size_t i = 0; i < model.splats; ++i)
                    if (words[pipeline::parameter_index(model.planes(), f, i)] != shared::FROZEN_MOMENT)
                        all[i] = false;
        }
        return all;
    }
};

pipeline::DensifyRules growing_rules() {
    pipeline::DensifyRules rules;
    rules.grow_gradient = 2e-4f;
    rules.split_scale = 0.05f;
    rules.prune_logit = -5;
    rules.seed = 7;
    rules.step = 700;
    rules.max_splats = 1u << 20;
    rules.frozen = true;
    return rules;
}

TEST(Frozen, DensifyKeepsThemAsTheyAre) {
    FrozenScene scene;
    const std::vector<float> growing(2 * size_t(FrozenScene::kSplats), 1.0f);
    scene.model.statistics.upload(std::span<const float>(growing));
    GuardedFrame guarded(rig().config(), {scene.model.splats, 16, 16, 1, true, false});
    densify({rig().cache, rig().executor, guarded.frame}, scene.model, growing_rules());
    EXPECT_TRUE(guarded.intact());
    const Gaussians after = download_model(scene.model, scene.model.params);
    const std::vector<bool> marks = scene.marks();
    uint32_t now = 0;
    for (uint32_t i = 0; i < FrozenScene::kSplats; ++i) {
        // The others are pruned, or cloned or split.
        const uint32_t outputs = FrozenScene::frozen(i) ? 1 : i % 2 == 0 ? 0 : 2;
        ASSERT_LE(now + outputs, scene.model.splats);
        for (uint32_t k = 0; k < outputs; ++k) ASSERT_EQ(marks[now + k], FrozenScene::frozen(i)) << i;
        if (FrozenScene::frozen(i)) scene.expect_frozen(after, now, i);
        now += outputs;
    }
    EXPECT_EQ(scene.model.splats, now);
}

TEST(Frozen, DensifyRemovesThemWithANegativeNumberOfViews) {
    FrozenScene scene;
    std::vector<float> statistics(2 * size_t(FrozenScene::kSplats));
    for (size_t i = 0; i < FrozenScene::kSplats; ++i) statistics[2 * i + 1] = i % 2 == 0 ? -1.0f : 0.0f;
    scene.model.statistics.upload(std::span<const float>(statistics));
    GuardedFrame guarded(rig().config(), {scene.model.splats, 16, 16, 1, true, false});
    EXPECT_EQ(densify({rig().cache, rig().executor, guarded.frame}, scene.model, growing_rules()).after,
              FrozenScene::kSplats / 2);
}

TEST(Frozen, RelocationSparesThem) {
    FrozenScene scene;
    pipeline::McmcRules rules;
    rules.growth = 3;
    rules.max_splats = 1u << 20;
    rules.seed = 7;
    rules.step = 700;
    rules.frozen = true;
    GuardedFrame guarded(rig().config(), {scene.model.splats, 16, 16, 1, true, false});
    const auto result = refine_mcmc({rig().cache, rig().executor, guarded.frame}, scene.model, rules);
    EXPECT_TRUE(guarded.intact());
    uint32_t dead = 0;
    std::set<float> places;  // of frozen splats
    for (uint32_t i = 0; i < FrozenScene::kSplats; ++i) {
        dead += i % 2 == 0 && !FrozenScene::frozen(i);
        if (FrozenScene::frozen(i)) places.insert(scene.gaussians.means[3 * i]);
    }
    EXPECT_EQ(result.relocated, dead);
    EXPECT_EQ(result.after, 3 * FrozenScene::kSplats);
    const Gaussians after = download_model(scene.model, scene.model.params);
    const std::vector<bool> marks = scene.marks();
    for (uint32_t j = 0; j < result.after; ++j) {
        const bool frozen = j < FrozenScene::kSplats && FrozenScene::frozen(j);
        ASSERT_EQ(marks[j], frozen) << j;
        if (frozen)
            scene.expect_frozen(after, j, j);
        else
            EXPECT_FALSE(places.contains(after.means[3 * j])) << "a copy of a frozen splat";
    }
}

TEST(Frozen, NoiseLeavesThem) {
    FrozenScene scene;
    pipeline::FrameBuffers frame;
    frame.instance_capacity = 10;
    const shared::Counts counts{};
    frame.reserve_counts(*device(), rig().config());
    frame.counts.upload(std::span<const shared::Counts>(&counts, 1));
    rig().run([&](gpu::Recording& recording) {
        record_noise({recording, rig().cache}, scene.model, frame,
                     {.amplitude = 5, .max_length = 1e9f, .seed = 1, .step = 12, .frozen = true});
    });
    const Gaussians after = download_model(scene.model, scene.model.params);
    size_t moved = 0;
    for (uint32_t i = 0; i < FrozenScene::kSplats; ++i) {
        if (FrozenScene::frozen(i)) scene.expect_frozen(after, i, i);
        moved += after.means[3 * i] != scene.gaussians.means[3 * i];
    }
    EXPECT_GT(moved, FrozenScene::kSplats / 4);
}

TEST(Frozen, ResetOpacityLeavesThem) {
    FrozenScene scene;
    rig().run([&](gpu::Recording& recording) {
        record_reset_opacity({recording, rig().cache}, scene.model, -4);
    });
    const Gaussians after = download_model(scene.model, scene.model.params);
    const std::vector<bool> marks = scene.marks();
    for (uint32_t i = 0; i < FrozenScene::kSplats; ++i) {
        EXPECT_EQ(marks[i], FrozenScene::frozen(i));
        const float before = scene.gaussians.opacity_logits[i];
        EXPECT_EQ(after.opacity_logits[i], FrozenScene::frozen(i) ? before : std::min(before, -4.0f));
    }
}

}  // namespace
}  // namespace ewa::test
