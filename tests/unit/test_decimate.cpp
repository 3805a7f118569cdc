// SPDX-License-Identifier: Apache-2.0
// Merging splats: the moments of a merged splat, which pairs are merged, and that nothing is lost on the way.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>
#include <map>
#include <numbers>

#include "ewa/splat_edit.h"
#include "scene/decimate.h"
#include "scene/splat_shape.h"
#include "support/splat_scenes.h"

namespace {

using namespace ewa;

/// Balls of one radius in a row along x.
Gaussians balls(const std::vector<float>& x, float radius, float opacity_logit) {
    Gaussians g;
    g.resize(x.size());
    for (size_t i = 0; i < g.size(); ++i) {
        g.means[3 * i] = x[i];
        for (size_t k = 0; k < 3; ++k) g.log_scales[3 * i + k] = std::log(radius);
        g.quaternions[4 * i] = 1;
        g.opacity_logits[i] = opacity_logit;
    }
    return g;
}

double opacity_of(const Gaussians& g, size_t i) {
    return 1 / (1 + std::exp(-double(g.opacity_logits[i])));
}

/// The integrals of the splat's Gaussian in the views along the three axes, by their formula.
double area_of(const Gaussians& g, size_t i) {
    const glm::dmat3 c = scene::covariance_of(g, i);
    double sum = 0;
    for (int a = 0; a < 3; ++a)
        for (int b = a + 1; b < 3; ++b)
            sum += 2 * std::numbers::pi * std::sqrt(c[a][a] * c[b][b] - c[a][b] * c[a][b]);
    return sum;
}

TEST(Decimate, KeepsMeanCovarianceColorAndLight) {
    Gaussians g = test::storable_splats(7, 2, 2);
    for (size_t i = 0; i < 2; ++i)
        for (size_t k = 0; k < 3; ++k) {
            g.log_scales[3 * i + k] = float(-1 - 0.3 * double(i + k));
            g.means[3 * i + k] *= 2;  // so far that they cover nothing together
        }
    g.opacity_logits = {-3, -4};
    const Gaussians before = g;
    decimate_splats(g, 1);
    ASSERT_EQ(g.size(), 1u);
    const double a = opacity_of(before, 0) * area_of(before, 0),
                 b = opacity_of(before, 1) * area_of(before, 1);
    const double p = a / (a + b), q = b / (a + b);
    const glm::dvec3 d = before.world_mean(0) - before.world_mean(1);
    const glm::dmat3 expected = p * scene::covariance_of(before, 0) + q * scene::covariance_of(before, 1) +
                                p * q * glm::outerProduct(d, d);
    const glm::dmat3 covariance = scene::covariance_of(g, 0);
    for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(g.world_mean(0)[k], (p * before.world_mean(0) + q * before.world_mean(1))[k], 1e-5);
        for (int row = 0; row < 3; ++row)
            EXPECT_NEAR(covariance[k][row], expected[k][row], 1e-5 * (expected[0][0] + expected[1][1]));
    }
    for (size_t k = 0; k < g.sh_stride(); ++k)
        EXPECT_NEAR(g.sh[k], p * before.sh[k] + q * before.sh[g.sh_stride() + k], 1e-6);
    EXPECT_NEAR(opacity_of(g, 0) * area_of(g, 0), a + b, 1e-5 * (a + b));
}

TEST(Decimate, WhatBothCoverCountsOnce) {
    Gaussians g = balls({0, 0}, 1, 0);  // both of opacity 1/2, at one place
    decimate_splats(g, 1);
    ASSERT_EQ(g.size(), 1u);
    // The integral of 1 - (1 - G/2)^2 = G - G^2/4 is that of G times 1 - 1/8.
    EXPECT_NEAR(opacity_of(g, 0), 0.875, 1e-6);
    EXPECT_NEAR(g.log_scales[0], 0, 1e-6);
    Gaussians opaque = balls({0, 0}, 1, 9);
    decimate_splats(opaque, 1);
    EXPECT_LE(opacity_of(opaque, 0), 0.9991);
    EXPECT_TRUE(drawable(opaque, 0));
}

TEST(Decimate, MergesWhatIsAlike) {
    // Two near pairs; the colours of the nearer one differ.
    Gaussians g = balls({0, 0.5f, 10, 10.8f}, 1, -1);
    g.sh[0] = 1.5f;
    g.sh[3] = -1.5f;
    decimate_splats(g, 3);
    ASSERT_EQ(g.size(), 3u);
    EXPECT_EQ(g.means[0], 0);
    EXPECT_EQ(g.means[3], 0.5f);
    EXPECT_NEAR(g.means[6], 10.4, 1e-5);
    // Without colours, the nearer one is cheaper.
    Gaussians grey = balls({0, 0.5f, 10, 10.8f}, 1, -1);
    decimate_splats(grey, 3);
    EXPECT_NEAR(grey.means[0], 0.25, 1e-6);
}

TEST(Decimate, ReachesEachNumberInTheSameWay) {
    const Gaussians scene = test::storable_splats(3, 3000, 1);
    for (const size_t target : {2999u, 1500u, 100u, 1u}) {
        Gaussians a = scene, b = scene;
        size_t last = scene.size();
        decimate_splats(a, target, [&](size_t left) {
            EXPECT_LT(left, last);
            last = left;
        });
        decimate_splats(b, target);
        EXPECT_EQ(a.size(), target);
        EXPECT_EQ(last, target);
        EXPECT_EQ(a.means, b.means);
        EXPECT_EQ(a.sh, b.sh);
        EXPECT_EQ(a.opacity_logits, b.opacity_logits);
        for (size_t i = 0; i < a.size(); ++i) ASSERT_TRUE(drawable(a, i)) << i;
    }
    Gaussians same = scene;
    decimate_splats(same, 5000);
    EXPECT_EQ(same.means, scene.means);
    decimate_splats(same, 0);
    EXPECT_EQ(same.size(), 1u);
}

TEST(Decimate, ManyAtOnePlaceAndExtremes) {
    // A query of a tree would visit all of them: this would take minutes.
    Gaussians g = balls(std::vector<float>(200'000, 1.f), 0.1f, -5);
    decimate_splats(g, 1000);
    EXPECT_EQ(g.size(), 1000u);
    EXPECT_EQ(g.means[0], 1);
    // Values of no size, no opacity, and none that is finite.
    Gaussians odd = test::storable_splats(5, 60, 0);
    for (size_t i = 0; i < 10; ++i) odd.opacity_logits[i] = -1000;
    for (size_t i = 10; i < 20; ++i) odd.log_scales[3 * i] = -200;
    for (size_t i = 20; i < 30; ++i) odd.log_scales[3 * i + 1] = 80;
    odd.means[90] = std::numeric_limits<float>::quiet_NaN();
    odd.opacity_logits[40] = std::numeric_limits<float>::infinity();
    odd.opacity_logits[41] = odd.log_scales[3 * 42] = -std::numeric_limits<float>::infinity();
    odd.log_scales[3 * 43] = 3e38f;
    decimate_splats(odd, 8);
    EXPECT_EQ(odd.size(), 8u);
    for (size_t i = 0; i < odd.size(); ++i) EXPECT_TRUE(drawable(odd, i)) << i;
}

/// Squares of such distances overflow float32.
TEST(Decimate, SplatsAsFarAsFloatsGo) {
    for (const float far : {3e19f, 1e30f, 3e38f})
        for (const bool all : {false, true}) {
            SCOPED_TRACE(testing::Message() << far << " " << all);
            Gaussians g = test::storable_splats(5, 300, 0);
            if (all)
                for (float& v : g.means) v = v < 0 ? -far : far;
            else
                g.means[0] = far;
            Gaussians to_one = g;
            decimate_splats(g, 100);
            EXPECT_EQ(g.size(), 100u);
            for (size_t i = 0; i < g.size(); ++i) EXPECT_TRUE(drawable(g, i)) << i;
            decimate_splats(to_one, 1);
            EXPECT_EQ(to_one.size(), 1u);
        }
}

TEST(Decimate, KeepsADensity) {
    Gaussians g = test::storable_splats(9, 100, 0);
    fit_opacities(g, true);
    decimate_splats(g, 50);
    EXPECT_TRUE(g.density);
    EXPECT_EQ(g.size(), 50u);
}

TEST(SplatShape, IsUndoneToTheCovariance) {
    Gaussians g = test::storable_splats(13, 200, 0);
    for (size_t i = 0; i < g.size(); ++i) {
        const glm::dmat3 before = scene::covariance_of(g, i);
        scene::set_covariance(g, i, before);
        const glm::dmat3 after = scene::covariance_of(g, i);
        const double size = before[0][0] + before[1][1] + before[2][2];
        for (int k = 0; k < 3; ++k)
            for (int row = 0; row < 3; ++row) EXPECT_NEAR(after[k][row], before[k][row], 2e-6 * size) << i;
    }
}

/// The squares of fields in the views along the axes, by sums over a grid.
TEST(DecimateTrace, ErrorsAreThoseOfTheImages) {
    Gaussians g = balls({-2.f, 2.f}, 0.7f, -1);
    for (size_t k = 0; k < 3; ++k) g.log_scales[3 + k] = std::log(0.4f);
    g.opacity_logits[1] = 0.5f;
    g.sh = {0.3f, -0.2f, 0.9f, -0.5f, 0.4f, 0.1f};
    const Gaussians before = g;
    std::vector<float> errors;
    scene::decimate_traced(g, 1, errors);
    ASSERT_EQ(errors.size(), 1u);
    double color = 0;
    for (size_t k = 0; k < 3; ++k)
        color += std::pow(double(before.sh[k]) - before.sh[3 + k], 2) / (4 * std::numbers::pi);
    const double a = opacity_of(before, 0) * area_of(before, 0),
                 b = opacity_of(before, 1) * area_of(before, 1);
    const double share = a / (a + b);
    // The opacity of a splat at a place of a view: x and y are two axes of the world.
    const auto at = [](const Gaussians& from, size_t i, int ax, int ay, double x, double y) {
        const glm::dmat3 c = scene::covariance_of(from, i);
        const glm::dvec3 mean = from.world_mean(i);
        const double dx = x - mean[ax], dy = y - mean[ay], xx = c[ax][ax], xy = c[ax][ay], yy = c[ay][ay];
        return opacity_of(from, i) *
               std::exp(-(yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy) / 2);
    };
    double colors = 0, opacities = 0, light = 0;
    constexpr double kStep = 0.05;
    for (const auto& [ax, ay] : {std::pair{0, 1}, {0, 2}, {1, 2}})
        for (double x = -8; x < 8; x += kStep)
            for (double y = -8; y < 8; y += kStep) {
                const double p = at(before, 0, ax, ay, x, y), q = at(before, 1, ax, ay, x, y);
                colors += color * std::pow((1 - share) * p - share * q, 2) * kStep * kStep;
                opacities += std::pow(p + q - at(g, 0, ax, ay, x, y), 2) * kStep * kStep;
                light += p * p * kStep * kStep;
            }
    EXPECT_NEAR(scene::squared_light(before, 0), light, 1e-6 * light);
    // What both cover in the view along x counts once, in the opacities; so the sums differ a little.
    EXPECT_NEAR(errors[0], colors + 0.03 * opacities, 0.1 * errors[0]);
}

TEST(DecimateTrace, ErrorsAreOfTheMergesInEachSplat) {
    Gaussians before = test::storable_splats(5, 4000, 1);
    Gaussians ordered = before;
    select_splats(ordered, morton_order(before));
    scene::put_neighbors_together(before);
    EXPECT_EQ(before.means, ordered.means);
    EXPECT_EQ(before.quaternions, ordered.quaternions);
    EXPECT_EQ(before.sh, ordered.sh);
    Gaussians g = before;
    std::vector<float> errors;
    scene::decimate_traced(g, 1000, errors);
    ASSERT_EQ(errors.size(), g.size());
    Gaussians plain = before;
    decimate_splats(plain, 1000);
    EXPECT_EQ(g.means, plain.means);
    // Splats that nothing was merged into are as they were.
    const auto place = [](const Gaussians& of, size_t i) {
        return std::array{of.means[3 * i], of.means[3 * i + 1], of.means[3 * i + 2]};
    };
    std::map<std::array<float, 3>, size_t> unmerged;
    for (size_t i = 0; i < before.size(); ++i) unmerged[place(before, i)] = i;
    double sum = 0;
    for (size_t k = 0; k < g.size(); ++k) {
        sum += errors[k];
        const auto found = unmerged.find(place(g, k));
        EXPECT_GE(errors[k], 0);
        if (errors[k] > 0) continue;
        ASSERT_NE(found, unmerged.end()) << k;
        EXPECT_EQ(g.opacity_logits[k], before.opacity_logits[found->second]);
    }
    // A further call adds to the errors.
    const Gaussians coarse = g;
    const std::vector<float> earlier = errors;
    scene::decimate_traced(g, 500, errors);
    ASSERT_EQ(errors.size(), 500u);
    std::map<std::array<float, 3>, float> known;
    for (size_t i = 0; i < coarse.size(); ++i) known[place(coarse, i)] = earlier[i];
    double all = 0;
    for (size_t k = 0; k < g.size(); ++k) {
        all += errors[k];
        if (const auto found = known.find(place(g, k)); found != known.end()) {
            EXPECT_GE(errors[k], found->second);
        }
    }
    EXPECT_GT(all, sum);
}

}  // namespace
