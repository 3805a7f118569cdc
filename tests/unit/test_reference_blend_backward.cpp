// SPDX-License-Identifier: Apache-2.0
// dL/d(footprint, colour) against central differences of the blend, on pictures without jumps.
#include "reference/blend.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "support/gradient_check.h"
#include "support/random_scene.h"

namespace ewa::reference {
namespace {

constexpr std::array<float, 3> kBackground{0.3f, 0.1f, 0.8f};

struct Case {
    std::vector<Projected> splats;
    TileGrid grid;
    Raster weights;  // L = sum weights * colour: dL/d(picture) is any picture one likes
    Smoothing smoothing;
};

Case random_case(uint64_t seed, test::SplatKind kind, AlphaCut cut) {
    const Camera camera = test::random_camera(seed);
    const Gaussians scene = test::random_gaussians(seed, 14, kind, camera, 1);
    Case c;
    for (size_t i = 0; i < scene.size(); ++i) c.splats.push_back(project(scene, i, camera, {}));
    c.grid = {camera.width, camera.height, 8, 8};
    c.weights = Raster(camera.width, camera.height, 3);
    test::Random random(seed + 77);
    for (double& w : c.weights.values) w = random.normal();
    c.smoothing = {cut, false};
    return c;
}

Instances lists_of(const Case& c) {
    return make_instances(c.splats, depth_order(c.splats), c.grid, c.smoothing);
}

double value(const Case& c) {
    const Blended out = blend(c.splats, lists_of(c), kBackground, c.smoothing);
    double sum = 0;
    for (size_t i = 0; i < out.color.values.size(); ++i) sum += c.weights.values[i] * out.color.values[i];
    return sum;
}

BlendGradients backward(const Case& c) {
    const Instances lists = lists_of(c);
    return blend_backward(c.splats, lists, blend(c.splats, lists, kBackground, c.smoothing), c.weights,
                          c.smoothing);
}

void check(Case c) {
    const BlendGradients gradients = backward(c);
    std::vector<double> means, shapes, opacities, colors, expected_means, expected_shapes, expected_opacities,
        expected_colors;
    for (size_t i = 0; i < c.splats.size(); ++i) {
        Projected& p = c.splats[i];
        if (!p.visible) continue;
        const ScreenGradient& g = gradients.splats[i];
        // det is a function of the covariance's entries.
        const auto f = [&] {
            p.det = p.a * p.c - p.b * p.b;
            return value(c);
        };
        const auto compare = [&](double& x, double claimed, std::vector<double>& actual,
                                 std::vector<double>& expected) {
            actual.push_back(claimed);
            expected.push_back(test::best_central_difference(f, x, claimed, 1e-4, 1e-6));
        };
        const double det = p.det;
        compare(p.mean2d.x, g.mean2d.x, means, expected_means);
        compare(p.mean2d.y, g.mean2d.y, means, expected_means);
        compare(p.a, g.a, shapes, expected_shapes);
        compare(p.b, g.b, shapes, expected_shapes);
        compare(p.c, g.c, shapes, expected_shapes);
        compare(p.opacity, g.opacity, opacities, expected_opacities);
        for (int k = 0; k < 3; ++k) compare(p.color[k], g.color[k], colors, expected_colors);
        p.det = det;
    }
    EXPECT_GT(means.size(), 4u);
    const test::GradientTolerance tolerance{1e-8, 1e-5, 1e-4, 1e-5};
    EXPECT_TRUE(test::gradients_agree(means, expected_means, tolerance)) << "means";
    EXPECT_TRUE(test::gradients_agree(shapes, expected_shapes, tolerance)) << "covariances";
    EXPECT_TRUE(test::gradients_agree(opacities, expected_opacities, tolerance)) << "opacities";
    EXPECT_TRUE(test::gradients_agree(colors, expected_colors, tolerance)) << "colours";
}

TEST(ReferenceBlendBackward, MatchesDifferences) {
    for (uint64_t seed = 0; seed < 4; ++seed)
        for (test::SplatKind kind :
             {test::SplatKind::ordinary, test::SplatKind::sub_pixel, test::SplatKind::mixed}) {
            SCOPED_TRACE(test::seed_text(seed) + " " + test::name_of(kind));
            check(random_case(seed, kind, AlphaCut::none));
            check(random_case(seed, kind, AlphaCut::ramp));
        }
}

TEST(ReferenceBlendBackward, NothingFlowsThroughAClampedAlpha) {
    Projected p;
    p.visible = true;
    p.z = 1;
    p.mean2d = {0.8, 0.4};
    p.a = p.c = 50;
    p.det = 2500;
    p.opacity = 0.9999;
    p.color = {1, 1, 1};
    Case c{{p}, {1, 1, 8, 8}, Raster(1, 1, 3), {}};
    c.weights.values = {1, 2, 3};
    const ScreenGradient g = backward(c).splats[0];
    EXPECT_EQ(g.opacity, 0);
    EXPECT_EQ(g.mean2d.x, 0);
    EXPECT_EQ(g.a, 0);
    EXPECT_NEAR(g.color.y, 2 * 0.99, 1e-12);
    c.splats[0].opacity = 0.98;
    EXPECT_NE(backward(c).splats[0].opacity, 0);
}

TEST(ReferenceBlendBackward, BehindTheStopThereIsNoGradient) {
    Projected p;
    p.visible = true;
    p.mean2d = {0.5, 0.5};
    p.a = p.c = 1;
    p.det = 1;
    p.opacity = 0.95;
    p.color = {1, 1, 1};
    Case c{std::vector<Projected>(6, p), {1, 1, 8, 8}, Raster(1, 1, 3), {}};
    c.weights.values = {1, 1, 1};
    const BlendGradients g = backward(c);
    // 0.05^3 = 1.25e-4 is above the stop, 0.05^4 is not.
    for (int i = 0; i < 6; ++i) EXPECT_EQ(g.splats[i].color.x > 0, i < 3) << i;
    EXPECT_NEAR(g.splats[2].color.x, 0.95 * 0.0025, 1e-12);
}

TEST(ReferenceBlendBackward, MomentsAddUpWhateverTheTiles) {
    Case c = random_case(3, test::SplatKind::ordinary, AlphaCut::hard);
    c.smoothing.transmittance_stop = true;
    const BlendGradients small = backward(c);
    c.grid.tile_width = 64;
    c.grid.tile_height = 64;
    const Instances one_tile = lists_of(c);
    ASSERT_EQ(one_tile.grid.count(), 1u);
    const BlendGradients whole = backward(c);
    EXPECT_LT(whole.instances.size(), small.instances.size());
    for (size_t k = 0; k < one_tile.sorted.size(); ++k) {
        const uint32_t splat = one_tile.sorted[k].splat;
        EXPECT_NEAR(whole.splats[splat].mean2d.x, small.splats[splat].mean2d.x, 1e-10);
        EXPECT_NEAR(whole.splats[splat].b, small.splats[splat].b, 1e-10);
        EXPECT_NEAR(whole.splats[splat].opacity * c.splats[splat].opacity, whole.instances[k].s0, 1e-10);
    }
}

/// The gradient is linear in the picture's: that of one pixel alone is what its absolute value is taken of.
TEST(ReferenceBlendBackward, AbsoluteGradientsAddUpPixelByPixel) {
    Case c = random_case(5, test::SplatKind::ordinary, AlphaCut::hard);
    const BlendGradients whole = backward(c);
    const Raster weights = c.weights;
    std::vector<glm::dvec2> sums(c.splats.size());
    for (size_t pixel = 0; pixel < weights.values.size() / 3; ++pixel) {
        std::fill(c.weights.values.begin(), c.weights.values.end(), 0);
        std::copy_n(weights.values.begin() + std::ptrdiff_t(3 * pixel), 3,
                    c.weights.values.begin() + std::ptrdiff_t(3 * pixel));
        const BlendGradients one = backward(c);
        for (size_t i = 0; i < sums.size(); ++i) sums[i] += glm::abs(one.splats[i].mean2d);
    }
    size_t cancelling = 0;
    for (size_t i = 0; i < sums.size(); ++i) {
        EXPECT_NEAR(whole.splats[i].absolute.x, sums[i].x, 1e-12 * (1 + sums[i].x)) << i;
        EXPECT_NEAR(whole.splats[i].absolute.y, sums[i].y, 1e-12 * (1 + sums[i].y)) << i;
        cancelling += sums[i].x > 2 * std::abs(whole.splats[i].mean2d.x);
    }
    EXPECT_GT(cancelling, 3u);
}

TEST(ReferenceBlendBackward, MomentsOfOnePixelByHand) {
    Projected p;
    p.visible = true;
    p.mean2d = {1.2, 0.1};
    p.a = 4;
    p.b = 1;
    p.c = 2;
    p.det = 7;
    p.opacity = 0.6;
    p.color = {1, 0, 0};
    Case c{{p}, {1, 1, 8, 8}, Raster(1, 1, 3), {}};
    c.weights.values = {2, 0, 0};
    const Moments m = backward(c).instances.at(0);
    const double dx = 0.5 - 1.2, dy = 0.5 - 0.1;
    const double u = (2 * dx - 1 * dy) / std::sqrt(14.0), v = dy / std::sqrt(2.0);
    const double alpha = 0.6 * std::exp(-0.5 * (2 * dx * dx - 2 * dx * dy + 4 * dy * dy) / 7);
    const double g = 2 * (1 - double(kBackground[0])) * alpha;
    EXPECT_NEAR(m.s0, g, 1e-12);
    EXPECT_NEAR(m.su, g * u, 1e-12);
    EXPECT_NEAR(m.sv, g * v, 1e-12);
    EXPECT_NEAR(m.suu, g * u * u, 1e-12);
    EXPECT_NEAR(m.suv, g * u * v, 1e-12);
    EXPECT_NEAR(m.svv, g * v * v, 1e-12);
    EXPECT_NEAR(m.color.x, 2 * alpha, 1e-12);
}

}  // namespace
}  // namespace ewa::reference
