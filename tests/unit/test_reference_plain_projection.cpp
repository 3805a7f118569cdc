// SPDX-License-Identifier: Apache-2.0
// The projection of the operators against the trainer's, and its gradient against central differences.
#include "reference/plain_projection.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "reference/projection.h"
#include "support/gradient_check.h"
#include "support/plain_splats.h"

namespace ewa::reference {
namespace {

TEST(ReferencePlainProjection, AgreesWithTheTrainersProjection) {
    int visible = 0;
    for (const bool covariances : {false, true}) {
        const Camera camera = test::random_camera(3, 160, 120);
        Gaussians gaussians = test::random_gaussians(4, 200, test::SplatKind::ordinary, camera, 0);
        test::PlainScene scene = test::plain_scene(3, 200, test::SplatKind::ordinary, 1, 160, 120);
        if (covariances) scene.use_covariances();
        RenderOptions options;
        options.kernel = Footprint::antialias;
        scene.options.compensations = true;
        scene.options.low_pass = float(shared::LOW_PASS_ANTIALIAS);
        for (size_t i = 0; i < scene.size(); ++i) {
            const Projected expected = project(gaussians, i, camera, options);
            if (!expected.visible) continue;
            const PlainProjected p = project(scene.splat(i), scene.view(0), scene.reference_options());
            ++visible;
            EXPECT_LT(glm::length(p.mean2d - expected.mean2d), 1e-3) << i;
            EXPECT_NEAR(p.depth / expected.z, 1, 1e-5) << i;
            const double size = std::max(expected.a, expected.c) / expected.det;
            EXPECT_NEAR(p.conic.x, expected.c / expected.det, 1e-4 * size) << i;
            EXPECT_NEAR(p.conic.y, -expected.b / expected.det, 1e-4 * size) << i;
            EXPECT_NEAR(p.conic.z, expected.a / expected.det, 1e-4 * size) << i;
            EXPECT_NEAR(p.compensation * scene.opacities[i], expected.opacity, 1e-4) << i;
        }
    }
    EXPECT_GT(visible, 100);
}

TEST(ReferencePlainProjection, WhatIsNotVisible) {
    PlainSplat splat;
    splat.mean = {0, 0, 4};
    splat.quaternion = {1, 0, 0, 0};
    splat.scale = glm::dvec3(0.1);
    PlainView view;
    view.focal = {100, 100};
    view.center = {32, 24};
    PlainOptions options;
    options.width = 64;
    options.height = 48;
    const double sigma = std::sqrt(2.5 * 2.5 + 0.3);
    EXPECT_TRUE(project(splat, view, options).visible);
    EXPECT_NEAR(project(splat, view, options).reach.x, 3.33 * sigma, 1e-9);
    const auto shown = [&](auto change) {
        PlainSplat s = splat;
        PlainView v = view;
        PlainOptions o = options;
        change(s, v, o);
        return project(s, v, o).visible;
    };
    EXPECT_FALSE(shown([](auto&, auto&, auto& o) { o.near = 4; }));
    EXPECT_FALSE(shown([](auto&, auto&, auto& o) { o.far = 4; }));
    EXPECT_FALSE(shown([](auto&, auto&, auto& o) { o.radius_clip = 9; }));
    EXPECT_TRUE(shown([](auto&, auto&, auto& o) { o.radius_clip = 8.9f; }));
    EXPECT_FALSE(shown([](auto& s, auto&, auto&) { s.opacity = 0.0039; }));
    EXPECT_TRUE(shown([](auto&, auto& v, auto&) { v.center.x = -8.9; }));
    EXPECT_FALSE(shown([](auto&, auto& v, auto&) { v.center.x = -9; }));
    EXPECT_FALSE(shown([](auto&, auto& v, auto&) { v.center.y = 48 + 9; }));
    PlainSplat faint = splat;
    faint.opacity = 0.1;
    EXPECT_NEAR(project(faint, view, options).reach.y, std::sqrt(2 * std::log(25.5)) * sigma, 1e-9);
}

TEST(ReferencePlainProjection, GradientMatchesDifferences) {
    int checked = 0, clamped = 0;
    for (uint64_t seed = 0; seed < 10; ++seed) {
        const auto kind = seed % 3 == 0 ? test::SplatKind::off_screen_and_close : test::SplatKind::ordinary;
        test::PlainScene scene = test::plain_scene(seed, 10, kind, 1, 41, 33, seed % 2 ? 0.1 : 0);
        if (seed % 4 >= 2) scene.use_covariances();
        scene.options.whiteners = seed >= 5;
        test::Random random(seed + 50);
        for (size_t i = 0; i < scene.size(); ++i) {
            SCOPED_TRACE(test::seed_text(seed) + ", splat " + std::to_string(i));
            PlainSplat splat = scene.splat(i);
            PlainView view = scene.view(0);
            const PlainProjected p = project(splat, view, scene.reference_options());
            if (!p.visible) continue;
            PlainScreenGradient g;
            g.mean2d = {random.normal(), random.normal()};
            g.depth = random.normal();
            g.conic = glm::dvec3(random.normal(), random.normal(), random.normal()) / (p.conic.x + p.conic.z);
            if (scene.options.whiteners) g.conic.y = random.normal();
            g.compensation = random.normal() / p.compensation;
            const auto value = [&] {
                const PlainProjected q = project(splat, view, scene.reference_options());
                return glm::dot(g.mean2d, q.mean2d) + g.depth * q.depth + glm::dot(g.conic, q.conic) +
                       g.compensation * q.compensation;
            };
            const PlainGradient claimed = project_backward(splat, view, scene.reference_options(), g);
            const auto compare = [&](const char* name, std::vector<double*> variables,
                                     std::vector<double> gradient) {
                std::vector<double> differences;
                for (size_t k = 0; k < variables.size(); ++k)
                    differences.push_back(test::best_central_difference(
                        value, *variables[k], gradient[k], splat.has_covariance ? 1e-5 : 1e-3, 1e-9));
                EXPECT_TRUE(test::gradients_agree(gradient, differences, {1e-8, 1e-4, 1e-3, 1e-5})) << name;
            };
            const PlainSplat& s = claimed.splat;
            compare("mean", {&splat.mean.x, &splat.mean.y, &splat.mean.z}, {s.mean.x, s.mean.y, s.mean.z});
            if (splat.has_covariance) {
                std::vector<double*> entries;
                for (double& entry : splat.covariance) entries.push_back(&entry);
                compare("covariance", entries, {s.covariance.begin(), s.covariance.end()});
            } else {
                auto& q = splat.quaternion;
                compare("quaternion", {&q[0], &q[1], &q[2], &q[3]},
                        {s.quaternion.begin(), s.quaternion.end()});
                compare("scale", {&splat.scale.x, &splat.scale.y, &splat.scale.z},
                        {s.scale.x, s.scale.y, s.scale.z});
            }
            std::vector<double*> matrix;
            std::vector<double> by_matrix;
            for (int column = 0; column < 4; ++column)
                for (int row = 0; row < 3; ++row) {
                    matrix.push_back(column == 3 ? &view.translation[row] : &view.rotation[column][row]);
                    by_matrix.push_back(column == 3 ? claimed.translation[row]
                                                    : claimed.rotation[column][row]);
                }
            compare("view matrix", matrix, by_matrix);
            ++checked;
            clamped += std::abs(p.mean2d.x - 20) > 31;
        }
    }
    EXPECT_GT(checked, 40);
    EXPECT_GT(clamped, 0);
}

}  // namespace
}  // namespace ewa::reference
