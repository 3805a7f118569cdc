// SPDX-License-Identifier: Apache-2.0
// The way back through projection against central differences of projection alone.
#include "reference/projection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "support/gradient_check.h"
#include "support/random_scene.h"

namespace ewa::reference {
namespace {

ScreenGradient random_gradient(test::Random& random, const Projected& p) {
    // Of the size that makes each part count alike.
    ScreenGradient g;
    g.mean2d = {random.normal(), random.normal()};
    g.a = random.normal() / p.a;
    g.b = random.normal() / std::sqrt(p.a * p.c);
    g.c = random.normal() / p.c;
    g.opacity = random.normal() / p.opacity;
    for (int k = 0; k < 3; ++k) g.color[k] = random.normal();
    return g;
}

double value(const Projected& p, const ScreenGradient& g) {
    return glm::dot(g.mean2d, p.mean2d) + g.a * p.a + g.b * p.b + g.c * p.c + g.opacity * p.opacity +
           glm::dot(g.color, p.color);
}

struct Check {
    Splat splat;
    Camera camera;
    RenderOptions options;
    ScreenGradient gradient;

    void compare(std::vector<double*> variables, const std::vector<double>& claimed, const char* name) {
        std::vector<double> differences;
        for (size_t k = 0; k < variables.size(); ++k)
            differences.push_back(test::best_central_difference(
                [&] { return value(project(splat, camera, options), gradient); }, *variables[k], claimed[k]));
        EXPECT_TRUE(test::gradients_agree(claimed, differences, {1e-9, 1e-5, 1e-4, 1e-6})) << name;
    }

    void run() {
        const Splat g = project_backward(splat, camera, options, gradient);
        compare({&splat.mean.x, &splat.mean.y, &splat.mean.z}, {g.mean.x, g.mean.y, g.mean.z}, "mean");
        auto& q = splat.quaternion;
        compare({&q[0], &q[1], &q[2], &q[3]}, {g.quaternion.begin(), g.quaternion.end()}, "quaternion");
        compare({&splat.log_scale.x, &splat.log_scale.y, &splat.log_scale.z},
                {g.log_scale.x, g.log_scale.y, g.log_scale.z}, "log scale");
        compare({&splat.opacity_logit}, {g.opacity_logit}, "opacity logit");
        std::vector<double*> sh;
        std::vector<double> by_sh;
        for (int j = 0; j < sh_coefficients(splat.sh_degree); ++j)
            for (int k = 0; k < 3; ++k) {
                sh.push_back(&splat.sh[j][k]);
                by_sh.push_back(g.sh[j][k]);
            }
        compare(sh, by_sh, "sh");
    }
};

TEST(ReferenceProjectBackward, MatchesDifferencesForEachKernelAndDegree) {
    int checked = 0, clamped = 0, dark = 0;
    for (uint64_t seed = 0; seed < 12; ++seed)
        for (int kernel = 0; kernel < 3; ++kernel) {
            const Camera camera = test::random_camera(seed);
            const int degree = int((seed + kernel) % 4);
            const auto kind =
                seed % 3 == 0 ? test::SplatKind::off_screen_and_close : test::SplatKind::ordinary;
            const Gaussians scene = test::random_gaussians(seed, 8, kind, camera, degree);
            test::Random random(seed * 3 + kernel);
            for (size_t i = 0; i < scene.size(); ++i) {
                SCOPED_TRACE(test::seed_text(seed) + ", kernel " + std::to_string(kernel) + ", degree " +
                             std::to_string(degree) + ", splat " + std::to_string(i));
                Check c{read_splat(scene, i), camera, {}, {}};
                c.options.kernel = Footprint(kernel);
                ProjectionSteps steps;
                const Projected p = project(c.splat, camera, c.options, &steps);
                if (!p.visible) continue;
                c.gradient = random_gradient(random, p);
                c.run();
                ++checked;
                if (!steps.slope_free.x || !steps.slope_free.y) ++clamped;
                if (p.color.x == 0 || p.color.y == 0 || p.color.z == 0) ++dark;
            }
        }
    EXPECT_GT(checked, 100);
    EXPECT_GT(clamped, 20);
    EXPECT_GT(dark, 20);
}

TEST(ReferenceProjectBackward, NeedlesToo) {
    int checked = 0;
    for (uint64_t seed = 0; seed < 6; ++seed) {
        const Camera camera = test::random_camera(seed);
        const Gaussians scene = test::random_gaussians(seed, 6, test::SplatKind::needles, camera, 1);
        test::Random random(seed);
        for (size_t i = 0; i < scene.size(); ++i) {
            SCOPED_TRACE(test::seed_text(seed) + ", splat " + std::to_string(i));
            Check c{read_splat(scene, i), camera, {}, {}};
            const Projected p = project(c.splat, camera, c.options);
            if (!p.visible) continue;
            c.gradient = random_gradient(random, p);
            c.run();
            ++checked;
        }
    }
    EXPECT_GT(checked, 15);
}

TEST(ReferenceProjectBackward, QuaternionNormScalesTheGradientInversely) {
    const Camera camera = test::random_camera(1);
    const Gaussians scene = test::random_gaussians(1, 8, test::SplatKind::ordinary, camera, 0);
    test::Random random(1);
    for (size_t i = 0; i < scene.size(); ++i) {
        Splat splat = read_splat(scene, i);
        const Projected p = project(splat, camera, {});
        if (!p.visible) continue;
        const ScreenGradient g = random_gradient(random, p);
        const Splat one = project_backward(splat, camera, {}, g);
        for (double& q : splat.quaternion) q *= 1e10;
        const Splat scaled = project_backward(splat, camera, {}, g);
        double along = 0, size = 0;
        for (int k = 0; k < 4; ++k) {
            EXPECT_NEAR(scaled.quaternion[k] * 1e10, one.quaternion[k],
                        1e-9 * (1 + std::abs(one.quaternion[k])));
            along += one.quaternion[k] * splat.quaternion[k] * 1e-10;
            size += std::abs(one.quaternion[k]);
        }
        EXPECT_NEAR(along, 0, 1e-9 * (1 + size));
    }
}

TEST(ReferenceProjectBackward, LowerDegreeAndHiddenSplatsGetNothing) {
    const Camera camera = test::random_camera(4);
    const Gaussians scene = test::random_gaussians(4, 8, test::SplatKind::ordinary, camera, 3);
    ScreenGradient g;
    g.color = {1, 1, 1};
    g.mean2d = {1, 1};
    RenderOptions options;
    options.sh_degree = 1;
    Splat splat = read_splat(scene, 0);
    splat.sh[0] = {2, 2, 2};
    const Splat back = project_backward(splat, camera, options, g);
    EXPECT_NE(back.sh[3].x, 0);
    for (int j = 4; j < kMaxCoefficients; ++j) EXPECT_EQ(back.sh[j], glm::dvec3(0));
    splat.opacity_logit = -20;
    const Splat hidden = project_backward(splat, camera, options, g);
    EXPECT_EQ(hidden.mean, glm::dvec3(0));
    EXPECT_EQ(hidden.sh[0], glm::dvec3(0));
}

}  // namespace
}  // namespace ewa::reference
