// SPDX-License-Identifier: Apache-2.0
// Which splats touch, against all pairs one by one, and which cameras see them.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <numbers>
#include <random>
#include <set>

#include "scene/splat_groups.h"

namespace {

using namespace ewa;

Gaussians balls(const std::vector<glm::vec4>& centres_and_radii) {
    Gaussians g;
    g.resize(centres_and_radii.size());
    for (size_t i = 0; i < g.size(); ++i) {
        const glm::vec4& ball = centres_and_radii[i];
        for (int k = 0; k < 3; ++k) {
            g.means[3 * i + size_t(k)] = ball[k];
            g.log_scales[3 * i + size_t(k)] = std::log(ball[3]);
        }
        g.quaternions[4 * i] = 1;
    }
    return g;
}

TEST(SplatGroups, TouchAtThreeDeviationsOfBoth) {
    // The deviation of a difference is sqrt(2) of these, so they touch up to 4.243.
    const auto groups = [](float x) {
        return scene::touching_groups(balls({{0, 0, 0, 1}, {x, 0, 0, 1}})).sizes.size();
    };
    EXPECT_EQ(groups(4.24f), 1u);
    EXPECT_EQ(groups(4.25f), 2u);
}

TEST(SplatGroups, OfAboutOneSizeAlone) {
    const auto groups = [](float r) {
        return scene::touching_groups(balls({{0, 0, 0, 1}, {0, 0, 0, r}})).sizes.size();
    };
    EXPECT_EQ(groups(1.99f), 1u);
    EXPECT_EQ(groups(2.01f), 2u);
    EXPECT_EQ(groups(0.51f), 1u);
    EXPECT_EQ(groups(0.49f), 2u);
}

TEST(SplatGroups, TheThinSideOfADisc) {
    Gaussians g = balls({{0, 0, 0, 1}, {0, 0, 1, 1}});
    for (size_t i = 0; i < 2; ++i) g.log_scales[3 * i + 2] = std::log(0.1f);
    EXPECT_EQ(scene::touching_groups(g).sizes.size(), 2u);  // one above the other
    // Turned by 90 degrees about x, both lie in the plane of y = 0, and touch.
    for (size_t i = 0; i < 2; ++i) g.quaternions[4 * i + 1] = 1;
    EXPECT_EQ(scene::touching_groups(g).sizes.size(), 1u);
}

TEST(SplatGroups, AgreesWithAllPairs) {
    std::mt19937 dice(5);
    std::uniform_real_distribution<float> uniform(0, 1);
    Gaussians g;
    g.resize(150);
    for (float& v : g.means) v = 12 * uniform(dice);
    for (float& v : g.quaternions) v = uniform(dice) - 0.5f;
    for (float& v : g.log_scales) v = 2.5f * uniform(dice) - 2.5f;
    g.means[3 * 7] = std::numeric_limits<float>::quiet_NaN();

    std::vector<size_t> set(g.size());
    const auto largest = [&](size_t i) {
        return std::max({g.log_scales[3 * i], g.log_scales[3 * i + 1], g.log_scales[3 * i + 2]});
    };
    const auto covariance = [&](size_t i) {
        glm::dmat3 axes(glm::normalize(glm::dquat(g.quaternions[4 * i], g.quaternions[4 * i + 1],
                                                  g.quaternions[4 * i + 2], g.quaternions[4 * i + 3])));
        for (int k = 0; k < 3; ++k) axes[k] *= std::exp(double(g.log_scales[3 * i + size_t(k)]));
        return axes * glm::transpose(axes);
    };
    for (size_t i = 0; i < g.size(); ++i) set[i] = i;
    for (size_t i = 0; i < g.size(); ++i)
        for (size_t j = 0; j < i; ++j) {
            const glm::dvec3 d = g.world_mean(i) - g.world_mean(j);
            if (std::abs(largest(i) - largest(j)) >= std::log(2.0) || !drawable(g, i) || !drawable(g, j))
                continue;
            if (glm::dot(d, glm::inverse(covariance(i) + covariance(j)) * d) >= 9) continue;
            const size_t from = set[i], to = set[j];
            for (size_t& s : set)
                if (s == from) s = to;
        }
    const scene::SplatGroups groups = scene::touching_groups(g);
    EXPECT_EQ(groups.sizes.size(), std::set<size_t>(set.begin(), set.end()).size());
    EXPECT_GT(groups.sizes.size(), 10u);
    EXPECT_GT(groups.sizes[0], 10u);
    for (size_t i = 0; i < g.size(); ++i)
        for (size_t j = 0; j < i; ++j) EXPECT_EQ(groups.of[i] == groups.of[j], set[i] == set[j]);
    EXPECT_EQ(groups.sizes[groups.of[7]], 1u);
    EXPECT_TRUE(std::is_sorted(groups.sizes.rbegin(), groups.sizes.rend()));
}

TEST(SplatGroups, ManyAtOnePlaceTakeNoSquareOfTheirNumber) {
    const scene::SplatGroups groups =
        scene::touching_groups(balls(std::vector<glm::vec4>(100'000, glm::vec4(1))));
    EXPECT_EQ(groups.sizes[0], 100'000u);
}

TEST(SplatGroups, InfiniteAndHugeScalesAreGroupsOfTheirOwn) {
    Gaussians g = balls({{0, 0, 0, 1}, {0.5f, 0, 0, 1}, {1, 0, 0, 1}, {1.5f, 0, 0, 1}});
    for (size_t k = 0; k < 3; ++k) {
        g.log_scales[k] = -std::numeric_limits<float>::infinity();
        g.log_scales[3 + k] = 3e38f;
    }
    const scene::SplatGroups groups = scene::touching_groups(g);
    EXPECT_EQ(groups.sizes, (std::vector<uint32_t>{2, 1, 1}));
    EXPECT_EQ(groups.of[2], groups.of[3]);
}

TEST(SplatGroups, ViewsThatHaveAMeanInTheirImage) {
    Camera camera;
    camera.width = camera.height = 100;
    camera.fx = camera.fy = camera.cx = camera.cy = 50;
    Camera back = camera;
    back.rotation = glm::dmat3(-1, 0, 0, 0, 1, 0, 0, 0, -1);
    const Gaussians g =
        balls({{0, 0, 5, 1}, {-0.1f, 0, -5, 1}, {4.9f, 0, 5, 1}, {5.1f, 0, 5, 1}, {0, 5.1f, 5, 1}});
    EXPECT_EQ(scene::views_of_splats(g, {camera, back, camera}), (std::vector<uint32_t>{2, 1, 2, 0, 0}));
    Camera all = camera;
    all.width = 200;
    all.distortion.lens = Lens::equirectangular;
    all.fx = all.fy = 100 / std::numbers::pi;
    all.cx = 100;
    EXPECT_EQ(scene::views_of_splats(g, {all}), (std::vector<uint32_t>{1, 1, 1, 1, 1}));
}

}  // namespace
