// SPDX-License-Identifier: Apache-2.0
// Lists and compositing: scenes whose answer is known, and a plain loop over all splats.
#include "reference/blend.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "reference/render.h"
#include "support/random_scene.h"

namespace ewa::reference {
namespace {

Projected round(double x, double y, double variance, double opacity, double z = 1) {
    Projected p;
    p.visible = true;
    p.z = z;
    p.mean2d = {x, y};
    p.a = p.c = variance;
    p.det = variance * variance;
    p.opacity = opacity;
    p.color = {1, 0.5, 0.25};
    return p;
}

Blended blend_all(const std::vector<Projected>& splats, int width, int height,
                  const std::array<float, 3>& background, const Smoothing& smoothing = {}) {
    const TileGrid grid{width, height, 8, 4};
    return blend(splats, make_instances(splats, depth_order(splats), grid, smoothing), background, smoothing);
}

TEST(ReferenceBlend, OneRoundSplatHasItsPeakRadiusAndTotal) {
    const double variance = 30, opacity = 0.8;
    const std::vector<Projected> splats = {round(50.5, 50.5, variance, opacity)};
    const Blended out = blend_all(splats, 101, 101, {0, 0, 0});
    EXPECT_NEAR(1 - *out.transmittance.at(50, 50), opacity, 1e-12);
    EXPECT_NEAR(out.color.at(50, 50)[1], 0.5 * opacity, 1e-12);
    const double radius = std::sqrt(2 * std::log(255 * opacity) * variance);
    double total = 0;
    for (int y = 0; y < 101; ++y)
        for (int x = 0; x < 101; ++x) {
            const double alpha = 1 - *out.transmittance.at(x, y);
            EXPECT_EQ(alpha > 0, std::hypot(x - 50, y - 50) <= radius) << x << " " << y;
            total += alpha;
        }
    // The integral within the radius: 2 pi variance (opacity - 1/255).
    EXPECT_NEAR(total, 2 * std::numbers::pi * variance * (opacity - 1.0 / 255), 0.3);
    // One standard deviation out: exp(-1/2).
    const std::vector<Projected> small = {round(50.5, 50.5, 25, opacity)};
    EXPECT_NEAR(1 - *blend_all(small, 101, 101, {0, 0, 0}).transmittance.at(55, 50), opacity * std::exp(-0.5),
                1e-12);
}

TEST(ReferenceBlend, ADensityKeepsItsMass) {
    Camera camera;
    camera.width = camera.height = 81;
    camera.fx = camera.fy = 60;
    camera.cx = 40;
    camera.cy = 41;
    Gaussians scene;
    scene.resize(1);
    scene.means = {0.05f, -0.1f, 2};
    scene.quaternions = {0.9f, 0.3f, -0.2f, 0.5f};
    scene.log_scales = {-2, -2.5f, -3};
    scene.opacity_logits = {0.4f};
    RenderOptions options;
    options.kernel = Footprint::density;
    ReferenceOptions reference;
    reference.smoothing.cut = AlphaCut::none;
    const Rendered rendered = render(scene, camera, options, reference);
    double total = 0;
    for (double t : rendered.blended.transmittance.values) total -= std::log(t);
    // 2 pi softplus(logit) A, in the camera's units times |J|.
    const double shadows = std::exp(-9.0) + std::exp(-11.0) + std::exp(-10.0);
    const double jacobian = 60 * 60 / 4.0 * std::sqrt(1 + 0.025 * 0.025 + 0.05 * 0.05);
    EXPECT_NEAR(total,
                2 * std::numbers::pi * std::log1p(std::exp(double(0.4f))) * std::sqrt(shadows / 3) * jacobian,
                1e-6);
}

TEST(ReferenceBlend, TwoOverlapNearestFirst) {
    std::vector<Projected> splats = {round(4.5, 4.5, 9, 0.5, 7), round(4.5, 4.5, 9, 0.25, 3)};
    splats[0].color = {1, 0, 0};
    splats[1].color = {0, 1, 0};
    const Blended out = blend_all(splats, 9, 9, {0, 0, 1});
    const double* pixel = out.color.at(4, 4);
    EXPECT_NEAR(pixel[1], 0.25, 1e-12);
    EXPECT_NEAR(pixel[0], 0.75 * 0.5, 1e-12);
    EXPECT_NEAR(pixel[2], 0.75 * 0.5, 1e-12);
    const double depth_sum = 3 * 0.25 + 7 * 0.75 * 0.5;
    EXPECT_NEAR(*out.depth_sum.at(4, 4), depth_sum, 1e-12);
    EXPECT_NEAR(*out.depth.at(4, 4), depth_sum / 0.625, 1e-12);
    EXPECT_EQ(out.blended[4 * 9 + 4], 2u);
}

TEST(ReferenceBlend, AlphaIsClampedAndBlendingStops) {
    // 0.99 twice leaves 1e-4, which is the stop: the second is left out.
    std::vector<Projected> splats = {round(4.5, 4.5, 9, 1.0, 1), round(4.5, 4.5, 9, 1.0, 2),
                                     round(4.5, 4.5, 9, 0.5, 3)};
    Blended out = blend_all(splats, 9, 9, {0, 0, 0});
    EXPECT_NEAR(*out.transmittance.at(4, 4), 0.01, 1e-15);
    EXPECT_EQ(out.blended[4 * 9 + 4], 1u);
    EXPECT_EQ(out.evaluated[4 * 9 + 4], 2u);
    // 0.9 four times would leave 1e-4 as well; three leave 1e-3.
    splats.assign(5, round(4.5, 4.5, 9, 0.9));
    out = blend_all(splats, 9, 9, {0, 0, 0});
    EXPECT_NEAR(*out.transmittance.at(4, 4), 1e-3, 1e-15);
    // A little less opacity and the fourth fits.
    splats.assign(5, round(4.5, 4.5, 9, 0.8995));
    out = blend_all(splats, 9, 9, {0, 0, 0});
    EXPECT_EQ(out.blended[4 * 9 + 4], 4u);
    Smoothing on;
    on.transmittance_stop = false;
    EXPECT_EQ(blend_all(splats, 9, 9, {0, 0, 0}, on).blended[4 * 9 + 4], 5u);
}

TEST(ReferenceBlend, ContributionsUnderTheFloorAreSkipped) {
    const double variance = 4;
    for (double opacity : {1.001 / 255, 0.999 / 255}) {
        const Blended out = blend_all({round(4.5, 4.5, variance, opacity)}, 9, 9, {0, 0, 0});
        EXPECT_EQ(*out.transmittance.at(4, 4) < 1, opacity > 1.0 / 255);
        EXPECT_EQ(*out.transmittance.at(5, 4), 1);
    }
}

TEST(ReferenceBlend, RampIsContinuousWithItsSlope) {
    Smoothing smoothing;
    smoothing.cut = AlphaCut::ramp;
    for (double raw : {1.0001 / 255, 1.3 / 255, 1.999 / 255, 2.001 / 255, 0.4}) {
        const double h = 1e-9;
        const double slope =
            (alpha_of(raw + h, smoothing).value - alpha_of(raw - h, smoothing).value) / (2 * h);
        EXPECT_NEAR(alpha_of(raw, smoothing).slope, slope, 1e-5);
    }
    for (double raw : {1.3 / 255, 1.999 / 255, 0.4, 4.6}) {
        const double h = 1e-9;
        const double slope =
            (alpha_of(raw + h, smoothing, true).value - alpha_of(raw - h, smoothing, true).value) / (2 * h);
        EXPECT_NEAR(alpha_of(raw, smoothing, true).slope, slope, 1e-5);
    }
    EXPECT_EQ(alpha_of(4.7, {}, true).value, 0.99);
    EXPECT_EQ(alpha_of(4.7, {}, true).slope, 0);
    EXPECT_EQ(alpha_of(0.99999 / 255, {}, true).kept, false);
    EXPECT_NEAR(alpha_of(0.5, {}, true).value, 1 - std::exp(-0.5), 1e-12);
    EXPECT_NEAR(alpha_of(1.0 / 255, smoothing).value, 0, 1e-12);
    EXPECT_EQ(alpha_of(0.999, smoothing).slope, 0);
    EXPECT_EQ(alpha_of(0.999, {}).value, 0.99);
    EXPECT_EQ(alpha_of(0.999, {}).slope, 0);
    EXPECT_EQ(alpha_of(0.5, {}).slope, 1);
}

/// The picture by the quadratic form with the inverse covariance, every splat at every pixel.
glm::dvec3 plain_pixel(const Rendered& rendered, int x, int y, const std::array<float, 3>& background) {
    glm::dvec3 color(0);
    double t = 1;
    for (uint32_t i : rendered.order) {
        const Projected& p = rendered.projected[i];
        const double dx = p.mean2d.x - (x + 0.5), dy = p.mean2d.y - (y + 0.5);
        const double power = -0.5 * (p.c * dx * dx - 2 * p.b * dx * dy + p.a * dy * dy) / p.det;
        const double alpha = std::min(0.99, p.opacity * std::exp(power));
        if (alpha < 1.0 / 255) continue;
        if (t * (1 - alpha) <= 1e-4) break;
        color += p.color * alpha * t;
        t *= 1 - alpha;
    }
    return color + t * glm::dvec3(background[0], background[1], background[2]);
}

TEST(ReferenceBlend, TilesDoNotChangeThePicture) {
    const RenderOptions options{{0.2f, 0.4f, 0.9f}, Footprint::peak, 3};
    for (uint64_t seed = 0; seed < 12; ++seed) {
        SCOPED_TRACE(test::seed_text(seed));
        const Camera camera = test::random_camera(seed);
        const Gaussians scene =
            test::random_gaussians(seed, 60, test::SplatKind::mixed, camera, int(seed % 4));
        const Rendered first = render(scene, camera, options);
        const Rendered second = render(scene, camera, options, {8, 8, {}});
        const Rendered third = render(scene, camera, options, {5, 32, {}});
        EXPECT_EQ(first.blended.color.values, second.blended.color.values);
        EXPECT_EQ(first.blended.color.values, third.blended.color.values);
        EXPECT_EQ(first.blended.blended, second.blended.blended);
        for (int y = 0; y < camera.height; ++y)
            for (int x = 0; x < camera.width; ++x) {
                const glm::dvec3 expected = plain_pixel(first, x, y, options.background);
                for (int k = 0; k < 3; ++k) EXPECT_NEAR(first.blended.color.at(x, y)[k], expected[k], 1e-6);
            }
    }
}

TEST(ReferenceInstances, ExactlyTheTilesWithAPixelAtTheFloor) {
    for (uint64_t seed = 0; seed < 6; ++seed) {
        SCOPED_TRACE(test::seed_text(seed));
        const Camera camera = test::random_camera(seed);
        const Gaussians scene = test::random_gaussians(seed, 60, test::SplatKind::mixed, camera, 0);
        const TileGrid grid{camera.width, camera.height, 4, 8};
        size_t listed = 0;
        for (size_t i = 0; i < scene.size(); ++i) {
            const Projected p = project(scene, i, camera, {});
            std::set<uint32_t> expected;
            for (int y = 0; p.visible && y < camera.height; ++y)
                for (int x = 0; x < camera.width; ++x)
                    if (sample(p, whitener(p), pixel_centre(x, y)).raw >= 1.0 / 255)
                        expected.insert(grid.tile_of(x, y));
            const std::vector<uint32_t> tiles = covered_tiles(p, grid);
            EXPECT_EQ(tiles, std::vector<uint32_t>(expected.begin(), expected.end())) << "splat " << i;
            listed += tiles.size();
        }
        EXPECT_GT(listed, 50u);
    }
}

TEST(ReferenceInstances, SortedByTileThenDepthWithBounds) {
    const Camera camera = test::random_camera(2, 45, 37);
    const Gaussians scene = test::random_gaussians(2, 40, test::SplatKind::ordinary, camera, 0);
    const Rendered rendered = render(scene, camera, {}, {8, 8, {}});
    const Instances& lists = rendered.instances;
    ASSERT_EQ(lists.first_of_tile.size(), lists.grid.count() + 1);
    EXPECT_EQ(lists.first_of_tile.back(), lists.sorted.size());
    EXPECT_EQ(lists.first_of_rank.back(), lists.sorted.size());
    for (uint32_t tile = 0; tile < lists.grid.count(); ++tile)
        for (size_t k = lists.first_of_tile[tile]; k < lists.first_of_tile[tile + 1]; ++k) {
            EXPECT_EQ(lists.sorted[k].tile, tile);
            if (k > lists.first_of_tile[tile]) {
                EXPECT_LE(rendered.projected[lists.sorted[k - 1].splat].z,
                          rendered.projected[lists.sorted[k].splat].z);
            }
        }
}

TEST(ReferenceOrder, TiesGoByIndexAndTheKeyIsFloat) {
    std::vector<Projected> splats = {round(0, 0, 1, 1, 3), round(0, 0, 1, 1, 2), round(0, 0, 1, 1, 3),
                                     round(0, 0, 1, 1, 1), round(0, 0, 1, 1, 2)};
    EXPECT_EQ(depth_order(splats), (std::vector<uint32_t>{3, 1, 4, 0, 2}));
    splats[1].visible = false;
    EXPECT_EQ(depth_order(splats), (std::vector<uint32_t>{3, 4, 0, 2}));
    // Nearer by less than a float32 step is a tie.
    splats[2].z = 3 - 1e-9;
    EXPECT_EQ(depth_order(splats), (std::vector<uint32_t>{3, 4, 0, 2}));
    splats[2].z = 3 - 1e-6;
    EXPECT_EQ(depth_order(splats), (std::vector<uint32_t>{3, 4, 2, 0}));
}

TEST(ReferenceScan, IsExclusiveWithTheTotal) {
    const std::vector<uint32_t> counts = {3, 0, 5, 4000000000u, 4000000000u};
    EXPECT_EQ(exclusive_scan(counts), (std::vector<uint64_t>{0, 3, 3, 8, 4000000008u, 8000000008u}));
    EXPECT_EQ(exclusive_scan({}), (std::vector<uint64_t>{0}));
}

}  // namespace
}  // namespace ewa::reference
