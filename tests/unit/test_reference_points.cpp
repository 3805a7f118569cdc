// SPDX-License-Identifier: Apache-2.0
// The CPU reference of spheres: closed forms of a pixel, and its gradient against central differences.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "reference/points.h"
#include "reference/render.h"
#include "shared/constants.h"
#include "support/gradient_check.h"
#include "support/random_scene.h"

namespace ewa::test {
namespace {

constexpr double kAlphaMax = shared::ALPHA_MAX;

/// Looks along z from the origin, with pixel (10, 8) on the axis.
Camera level_camera() {
    Camera camera;
    camera.width = 21;
    camera.height = 17;
    camera.fx = 40;
    camera.fy = 30;
    camera.cx = 10.5;
    camera.cy = 8.5;
    return camera;
}

/// A grey sphere on the axis, without view-dependent colour.
void add_sphere(Gaussians& g, double z, double scale, double grey, double x = 0) {
    g.resize(g.size() + 1);
    const size_t i = g.size() - 1;
    g.means[3 * i] = float(x);
    g.means[3 * i + 2] = float(z);
    g.quaternions[4 * i] = 1;
    for (int k = 0; k < 3; ++k) {
        g.log_scales[3 * i + size_t(k)] = float(std::log(scale));
        g.sh[3 * i + size_t(k)] = float((grey - shared::COLOR_OFFSET) / shared::SH_C0);
    }
}

RenderOptions spheres(int nearest = 8) {
    RenderOptions options;
    options.points = true;
    options.nearest = nearest;
    return options;
}

double red(const reference::Rendered& rendered, int x, int y) {
    return rendered.blended.color.at(x, y)[0];
}

TEST(ReferencePoints, ASphereFadesWithTheSquareOfTheDistance) {
    Gaussians g;
    add_sphere(g, 4, 0.3, 0.75);
    const auto rendered = reference::render(g, level_camera(), spheres());
    const double rx = 2 * std::sqrt(std::pow(40 * 0.3 / 4, 2) + 0.3),
                 ry = 2 * std::sqrt(std::pow(30 * 0.3 / 4, 2) + 0.3);
    for (const auto& [dx, dy] : {std::pair{0, 0}, {1, 0}, {0, 3}, {-4, 1}, {5, 2}, {7, 0}, {0, 5}}) {
        const double q = std::pow(dx / rx, 2) + std::pow(dy / ry, 2);
        const double alpha = q < 1 ? std::min(kAlphaMax, 1 - q) : 0;
        EXPECT_NEAR(red(rendered, 10 + dx, 8 + dy), 0.75 * alpha, 1e-7) << dx << ' ' << dy;
        EXPECT_NEAR(*rendered.blended.transmittance.at(10 + dx, 8 + dy), 1 - alpha, 1e-7);
    }
    EXPECT_NEAR(*rendered.blended.depth.at(10, 8), 4, 1e-6);
}

TEST(ReferencePoints, OpacityRotationAndTheRatioOfTheScalesDoNotCount) {
    Gaussians round, other;
    add_sphere(round, 4, 0.3, 0.75);
    other = round;
    other.opacity_logits[0] = -20;
    other.quaternions = {0.3f, -2, 1, 4};
    other.log_scales[0] += 1.5f;
    other.log_scales[2] -= 1.5f;
    const auto a = reference::render(round, level_camera(), spheres());
    const auto b = reference::render(other, level_camera(), spheres());
    for (size_t i = 0; i < a.blended.color.values.size(); ++i)
        EXPECT_NEAR(a.blended.color.values[i], b.blended.color.values[i], 1e-6);
}

TEST(ReferencePoints, APixelBlendsTheNearestAndNoMore) {
    Gaussians g;
    const double greys[] = {0.2, 0.9, 0.4, 0.7};
    // Beside the axis, so that none is opaque at the pixel. The farthest is stored first.
    for (int k = 3; k >= 0; --k) add_sphere(g, 4 + 0.1 * k, 0.3, greys[k], 0.3);
    for (int nearest = 1; nearest <= 5; ++nearest) {
        const auto rendered = reference::render(g, level_camera(), spheres(nearest));
        double color = 0, left = 1;
        for (int k = 0; k < std::min(nearest, 4); ++k) {
            const double z = 4 + 0.1 * k, dx = 40 * 0.3 / z;
            const double alpha = 1 - dx * dx / (4 * (std::pow(40 * 0.3 / z, 2) + 0.3));
            color += greys[k] * alpha * left;
            left *= 1 - alpha;
        }
        EXPECT_NEAR(red(rendered, 10, 8), color, 1e-6) << nearest;
        EXPECT_EQ(rendered.blended.blended[8 * 21 + 10], uint32_t(std::min(nearest, 4)));
    }
}

TEST(ReferencePoints, ATinySphereIsAPixelWide) {
    for (const double scale : {1e-3, 1e-12, 1e-30}) {
        for (const double shift : {0.0, 0.25, 0.5}) {  // px
            Gaussians g;
            add_sphere(g, 4, scale, 0.75, shift * 4 / 40);
            const auto rendered = reference::render(g, level_camera(), spheres());
            double seen = 0;
            for (const double t : rendered.blended.transmittance.values) seen += 1 - t;
            EXPECT_GT(seen, 0.9) << scale << ' ' << shift;
            EXPECT_LT(seen, 2.1) << scale << ' ' << shift;
        }
    }
}

TEST(ReferencePoints, InvisibleAndDamagedSplatsAreLeftOut) {
    Gaussians g;
    add_sphere(g, 4, 0.3, 0.75);
    add_sphere(g, -4, 0.3, 0.9);
    add_sphere(g, 0.01, 0.3, 0.9);
    add_sphere(g, 4, 0.3, 0.9);
    g.log_scales[10] = std::nanf("");
    add_sphere(g, 4, 0.3, 0.9);
    g.quaternions[16] = 0;
    add_sphere(g, 4, 1e30, 0.9);
    const auto rendered = reference::render(g, level_camera(), spheres());
    EXPECT_EQ(rendered.order, (std::vector<uint32_t>{0, 5})) << "the last sphere fills the view";
    EXPECT_EQ(rendered.skipped_nonfinite, 2u);
}

struct Stiff {
    const char* name;
    SplatKind kind;
    std::function<void(Gaussians&, Camera&)> change;
    int nearest;
};

class ReferencePointsGradient : public testing::TestWithParam<Stiff> {};

TEST_P(ReferencePointsGradient, IsTheSlopeOfTheLoss) {
    const Stiff& stiff = GetParam();
    Camera camera = random_camera(811, 26, 19);
    Gaussians g = random_gaussians(812, 7, stiff.kind, camera, 1);
    stiff.change(g, camera);
    const Image target = random_target(813, 26, 19);
    RenderOptions options = spheres(stiff.nearest);
    options.background = {0.3f, 0.6f, 0.1f};
    reference::Values values = g;
    const auto cpu = reference::loss_gradient(values, camera, target, options);
    const auto loss = [&] { return reference::loss_gradient(values, camera, target, options).loss; };
    const auto check = [&](const char* name, std::vector<double>& group, const std::vector<double>& claimed,
                           double step) {
        std::vector<double> slope;
        for (size_t i = 0; i < group.size(); ++i)
            slope.push_back(best_central_difference(loss, group[i], claimed[i], step, 1e-4 * step));
        GradientTolerance tolerance;
        tolerance.element_absolute = 1e-4;
        EXPECT_TRUE(gradients_agree(claimed, slope, tolerance)) << name;
    };
    // A step of a mean is a share of the depth.
    const double z = std::abs((camera.rotation * g.world_mean(0) + camera.translation).z);
    check("means", values.means, cpu.gradient.means, 1e-4 * std::min(z, 1.0));
    check("log scales", values.log_scales, cpu.gradient.log_scales, 1e-4);
    check("sh", values.sh, cpu.gradient.sh, 1e-3);
    for (const double q : cpu.gradient.quaternions) EXPECT_EQ(q, 0);
    for (const double o : cpu.gradient.opacity_logits) EXPECT_EQ(o, 0);
}

void scaled(Gaussians& g, double factor) {
    for (float& s : g.log_scales) s += float(std::log(factor));
}

INSTANTIATE_TEST_SUITE_P(
    All, ReferencePointsGradient,
    testing::Values(Stiff{"ordinary", SplatKind::ordinary, [](Gaussians&, Camera&) {}, 8},
                    Stiff{"nearest_2", SplatKind::ordinary, [](Gaussians&, Camera&) {}, 2},
                    Stiff{"small", SplatKind::ordinary, [](Gaussians& g, Camera&) { scaled(g, 1e-2); }, 8},
                    Stiff{"large", SplatKind::ordinary, [](Gaussians& g, Camera&) { scaled(g, 30); }, 8},
                    Stiff{"close", SplatKind::off_screen_and_close, [](Gaussians&, Camera&) {}, 8},
                    Stiff{"coinciding", SplatKind::ordinary,
                          [](Gaussians& g, Camera&) {
                              for (size_t i = 3; i < g.means.size(); ++i) g.means[i] = g.means[i % 3];
                          },
                          8}),
    [](const testing::TestParamInfo<Stiff>& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace ewa::test
