// SPDX-License-Identifier: Apache-2.0
// Adaptive density control: each decision at its threshold, and what comes of it.
#include "reference/training.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>

#include "reference/projection.h"
#include "support/random_scene.h"

namespace ewa::reference {
namespace {

Splat make(double scale, double opacity) {
    Splat splat;
    splat.quaternion = {1, 0, 0, 0};
    splat.log_scale = {std::log(scale / 5), std::log(scale), std::log(scale / 3)};
    splat.opacity_logit = std::log(opacity / (1 - opacity));
    return splat;
}

TEST(ReferenceDensify, DecisionsAtTheirThresholds) {
    DensifyOptions options;
    options.extent = 10;  // clone up to 0.1, prune from 1
    const double grow = 2e-4;
    EXPECT_EQ(decide(make(0.05, 0.5), 0.99 * grow, options), Decision::keep);
    EXPECT_EQ(decide(make(0.05, 0.5), grow, options), Decision::clone);
    EXPECT_EQ(decide(make(0.099, 0.5), 2 * grow, options), Decision::clone);
    EXPECT_EQ(decide(make(0.101, 0.5), 2 * grow, options), Decision::split);
    EXPECT_EQ(decide(make(0.101, 0.5), 0, options), Decision::keep);
    EXPECT_EQ(decide(make(0.05, 0.0049), 2 * grow, options), Decision::prune);
    EXPECT_EQ(decide(make(0.05, 0.0051), 0, options), Decision::keep);
    Splat poison = make(0.05, 0.5);
    poison.opacity_logit = std::nan("");
    EXPECT_EQ(decide(poison, 0, options), Decision::prune);
}

TEST(ReferenceDensify, LargeOnesGoOnceOpacityHasBeenReset) {
    DensifyOptions options;
    options.extent = 10;
    EXPECT_EQ(decide(make(1.1, 0.5), 0, options), Decision::keep);
    options.prune_large = true;
    EXPECT_EQ(decide(make(1.1, 0.5), 0, options), Decision::prune);
    EXPECT_EQ(decide(make(0.99, 0.5), 0, options), Decision::keep);
    // The children of a split have scales 1.6 times smaller.
    EXPECT_EQ(decide(make(1.5, 0.5), 1, options), Decision::split);
    EXPECT_EQ(decide(make(1.7, 0.5), 1, options), Decision::prune);
}

TEST(ReferenceDensify, WhatIsLargerThanItsDistanceToAllCamerasGoes) {
    DensifyOptions options;
    options.extent = 10;
    Splat splat = make(3.1, 0.5);
    splat.mean = {1, 2, 5};
    EXPECT_EQ(decide(splat, 0, options), Decision::keep);
    options.ball = {{1, 2, 3}, 1};
    EXPECT_EQ(decide(splat, 0, options), Decision::prune);
    EXPECT_EQ(decide(splat, 1, options), Decision::prune);  // it does not split, either
    splat.log_scale = make(2.9, 0.5).log_scale;
    EXPECT_EQ(decide(splat, 0, options), Decision::keep);
    EXPECT_EQ(decide(splat, 1, options), Decision::split);
}

TEST(ReferenceDensify, StatisticsAreInDeviceCoordinatesOverViews) {
    Camera camera;
    camera.width = 200;
    camera.height = 100;
    DensifyStatistics statistics(2);
    std::vector<ScreenGradient> gradients(2);
    gradients[0].mean2d = {3e-6, 8e-6};
    gradients[1].mean2d = {1, 1};
    accumulate(statistics, gradients, std::vector<uint8_t>{1, 0}, camera);
    accumulate(statistics, gradients, std::vector<uint8_t>{1, 0}, camera);
    EXPECT_NEAR(statistics.gradient_sum[0], 2 * 5e-4, 1e-15);
    EXPECT_EQ(statistics.views[0], 2u);
    EXPECT_EQ(statistics.gradient_sum[1], 0);
    EXPECT_EQ(statistics.views[1], 0u);

    Values values;
    values.resize(2);
    write_splat(values, 0, make(0.001, 0.5));
    write_splat(values, 1, make(0.001, 0.5));
    EXPECT_EQ(decide(values, statistics, {}), (std::vector<Decision>{Decision::clone, Decision::keep}));
    // The mean, not the sum: 5e-4 each.
    DensifyOptions options;
    options.grow_gradient = 6e-4;
    EXPECT_EQ(decide(values, statistics, options), (std::vector<Decision>{Decision::keep, Decision::keep}));
}

TEST(ReferenceDensify, TheCapHoldsAndPrunedSplatsMakeRoom) {
    Values values;
    values.resize(4);
    DensifyStatistics statistics(4);
    for (size_t i = 0; i < 4; ++i) {
        write_splat(values, i, make(i == 2 ? 0.5 : 0.001, i == 0 ? 0.001 : 0.5));
        statistics.gradient_sum[i] = 1;
        statistics.views[i] = 1;
    }
    DensifyOptions options;
    options.max_splats = 5;
    const std::vector<Decision> decisions = decide(values, statistics, options);
    EXPECT_EQ(decisions,
              (std::vector<Decision>{Decision::prune, Decision::clone, Decision::split, Decision::keep}));
    EXPECT_EQ(densify(values, decisions, std::vector<glm::dvec3>(2)).values.size(), 5u);
    options.max_splats = 2;
    for (Decision d : decide(values, statistics, options))
        EXPECT_TRUE(d == Decision::keep || d == Decision::prune);
}

TEST(ReferenceDensify, WhatComesOfEachDecision) {
    const Camera camera = test::random_camera(1);
    const Values values = test::random_gaussians(1, 4, test::SplatKind::ordinary, camera, 1);
    const std::vector<Decision> decisions = {Decision::split, Decision::clone, Decision::prune,
                                             Decision::keep};
    const std::vector<glm::dvec3> normals = {{1, 0, 0}, {0, -2, 0.5}};
    const Densified out = densify(values, decisions, normals);
    EXPECT_EQ(out.source, (std::vector<uint32_t>{1, 3, 1, 0, 0}));
    EXPECT_EQ(out.fresh, (std::vector<uint8_t>{0, 0, 1, 1, 1}));
    ASSERT_EQ(out.values.size(), 5u);
    const Splat original = read_splat(values, 1), copy = read_splat(out.values, 2);
    EXPECT_EQ(copy.mean, original.mean);
    EXPECT_EQ(copy.log_scale, original.log_scale);
    EXPECT_EQ(copy.sh, original.sh);

    const Splat parent = read_splat(values, 0);
    ProjectionSteps steps;
    ASSERT_TRUE(project(parent, camera, {}, &steps).visible);
    const Splat first = read_splat(out.values, 3), second = read_splat(out.values, 4);
    // One standard deviation along the first axis.
    EXPECT_NEAR(glm::length(first.mean - parent.mean - steps.rotation[0] * steps.scale.x), 0, 1e-12);
    EXPECT_NEAR(glm::length(second.mean - parent.mean + 2.0 * steps.rotation[1] * steps.scale.y -
                            0.5 * steps.rotation[2] * steps.scale.z),
                0, 1e-12);
    EXPECT_NEAR(std::exp(parent.log_scale.y - first.log_scale.y), 1.6, 1e-12);
    EXPECT_EQ(first.opacity_logit, parent.opacity_logit);
    EXPECT_EQ(first.quaternion, parent.quaternion);
    EXPECT_EQ(first.sh, parent.sh);
}

TEST(ReferenceDensify, ThinnedSplatsLetThroughTogetherWhatOneDid) {
    for (const double logit : {-12.0, -2.0, 0.0, 3.0, 12.0}) {
        Splat parent = make(0.5, 0.5);
        parent.opacity_logit = logit;
        for (const int parts : {1, 2, 5}) {
            const double through = 1 / (1 + std::exp(thinned(parent, 1.0 / parts).opacity_logit));
            EXPECT_NEAR(std::pow(through, parts) * (1 + std::exp(logit)), 1, 1e-11) << logit << " " << parts;
        }
    }
}

/// The children have the parent's mean, second moment and, as faint splats, its opacity times its volume.
TEST(ReferenceDensify, AnEvenSplitKeepsTheMoments) {
    const Camera camera = test::random_camera(1);
    const Values values = test::random_gaussians(3, 20, test::SplatKind::ordinary, camera, 0);
    for (size_t i = 0; i < 20; ++i) {
        Splat parent = read_splat(values, i);
        parent.opacity_logit = -9;
        const Splat children[] = {even_child(parent, true), even_child(parent, false)};
        const auto covariance = [](const Splat& splat) {
            const glm::dmat3 axes = glm::mat3_cast(glm::normalize(glm::dquat(
                splat.quaternion[0], splat.quaternion[1], splat.quaternion[2], splat.quaternion[3])));
            glm::dmat3 scaled = axes;
            for (int k = 0; k < 3; ++k) scaled[k] *= std::exp(splat.log_scale[k]);
            return scaled * glm::transpose(scaled);
        };
        const auto mass = [](const Splat& splat) {
            return std::exp(splat.log_scale.x + splat.log_scale.y + splat.log_scale.z) /
                   (1 + std::exp(-splat.opacity_logit));
        };
        EXPECT_NEAR(mass(children[0]) + mass(children[1]), mass(parent), 1e-4 * mass(parent));
        EXPECT_NEAR(glm::length(0.5 * (children[0].mean + children[1].mean) - parent.mean), 0, 1e-12);
        const glm::dvec3 off = children[0].mean - parent.mean;
        EXPECT_GT(glm::length(off), 0);
        const glm::dmat3 both = covariance(children[0]) + glm::outerProduct(off, off),
                         one = covariance(parent);
        for (int c = 0; c < 3; ++c)
            for (int r = 0; r < 3; ++r) EXPECT_NEAR(both[c][r], one[c][r], 1e-12);
    }
}

TEST(ReferenceDensify, OpacityIsResetDownwardsOnly) {
    Values values;
    values.resize(2);
    values.opacity_logits = {2.0, -7.0};
    reset_opacity(values, 0.01);
    EXPECT_NEAR(1 / (1 + std::exp(-values.opacity_logits[0])), 0.01, 1e-12);
    EXPECT_EQ(values.opacity_logits[1], -7.0);
}

}  // namespace
}  // namespace ewa::reference
