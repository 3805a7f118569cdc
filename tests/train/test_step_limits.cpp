// SPDX-License-Identifier: Apache-2.0
// Steps that would throw a splat out of every view are shortened and counted; ordinary scenes have none.
#include <gtest/gtest.h>

#include <cmath>

#include "ewa/trainer.h"
#include "gpu/test_device.h"
#include "shared/constants.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

struct Ran {
    Gaussians gaussians;
    StepReport report;
};
Ran run(const Gaussians& start, TrainOptions options) {
    const std::vector<int> frames = all_frames(small_capture().dataset);
    Trainer trainer(device(), small_capture().dataset, frames, start, options);
    Ran ran;
    while (trainer.steps_done() < options.steps) ran.report = trainer.step();
    ran.gaussians = trainer.gaussians();
    return ran;
}

TrainOptions plain(int steps) {
    TrainOptions options;
    options.steps = steps;
    options.sh_degree = 0;
    options.strategy = Strategy::none;
    return options;
}

TEST(StepLimits, DoNothingInAnOrdinaryScene) {
    const Ran ran = run(gaussians_from_points(small_capture().dataset.points, 0), plain(100));
    EXPECT_EQ(ran.report.limited_steps, 0u);
    EXPECT_EQ(ran.report.dropped_updates, 0u);
}

TEST(StepLimits, AMeanMovesByHalfItsDepthAtMost) {
    TrainOptions options = plain(1);
    options.means_rate = options.means_rate_final = 1e6;  // a step of a million scene sizes
    const Gaussians start = gaussians_from_points(small_capture().dataset.points, 0);
    const Ran ran = run(start, options);
    EXPECT_GT(ran.report.limited_steps, 0u);
    // The cameras stand 4 units off and see at most 6.
    for (size_t i = 0; i < ran.gaussians.size(); ++i)
        EXPECT_LT(glm::length(ran.gaussians.world_mean(i)), 2 + 6 * shared::STEP_DEPTH_SHARE + 1e-3) << i;
}

TEST(StepLimits, AScaleStaysWithinWhatCanBeDrawn) {
    TrainOptions options = plain(3);
    options.scale_rate = 1e5;
    const Ran ran = run(gaussians_from_points(small_capture().dataset.points, 0), options);
    EXPECT_GT(ran.report.limited_steps, 0u);
    for (const float s : ran.gaussians.log_scales) {
        EXPECT_GE(s, shared::LOG_SCALE_MIN);
        EXPECT_LE(s, shared::LOG_SCALE_MAX);
    }
}

TEST(StepLimits, AQuaternionOfAnyNormTurnsAsOneOfNormOne) {
    Gaussians start = gaussians_from_points(small_capture().dataset.points, 0);
    for (size_t i = 0; i < start.size(); ++i) start.log_scales[3 * i] += 0.5f;
    const Ran one = run(start, plain(20));
    for (const float norm : {1e-20f, 1e20f}) {
        Gaussians odd = start;
        for (float& q : odd.quaternions) q *= norm;
        const Ran ran = run(odd, plain(20));
        EXPECT_EQ(ran.report.dropped_updates, 0u);
        for (size_t i = 0; i < ran.gaussians.quaternions.size(); ++i)
            EXPECT_NEAR(ran.gaussians.quaternions[i], one.gaussians.quaternions[i], 1e-5);
    }
}

/// A splat much larger than the scene would be thrown across it by MCMC's noise, which grows with its scales
/// squared.
TEST(StepLimits, NoiseIsNoLongerThanTheScene) {
    Gaussians start = gaussians_from_points(small_capture().dataset.points, 0);
    for (float& s : start.log_scales) s = 12;
    for (float& o : start.opacity_logits) o = -6;
    TrainOptions options = plain(2);
    options.strategy = Strategy::mcmc;
    const Ran ran = run(start, options);
    EXPECT_GT(ran.report.limited_steps, 0u);
    for (size_t i = 0; i < ran.gaussians.size(); ++i) EXPECT_LT(glm::length(ran.gaussians.world_mean(i)), 30);
}

}  // namespace
}  // namespace ewa::test
