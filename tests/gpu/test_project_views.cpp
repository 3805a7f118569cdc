// SPDX-License-Identifier: Apache-2.0
// The operators of projection against the CPU reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "ewa/error.h"
#include "ewa/operators.h"
#include "gpu/guarded.h"
#include "passes/passes.h"
#include "support/gradient_check.h"
#include "support/plain_splats.h"

namespace ewa::test {
namespace {

inline SharedByTests<Operators>* const operators_of_all = SharedByTests<Operators>::add();
Operators& operators() {
    return operators_of_all->get([] { return Operators(device()); });
}

struct ViewsCase {
    const char* name;
    SplatKind kind;
    size_t splats, views;
    bool covariances, opacities, compensations;
    double bend;
    float low_pass;
    double shape, gradient;  // largest relative errors
    bool whiteners = false;
};

class ViewsPass : public testing::TestWithParam<ViewsCase> {
  protected:
    ViewsPass() : c(GetParam()) {
        scene = plain_scene(70 + c.splats, c.splats, c.kind, c.views, 160, 120, c.bend);
        scene.options.low_pass = c.low_pass;
        scene.options.compensations = c.compensations;
        scene.options.whiteners = c.whiteners;
        if (c.covariances) scene.use_covariances();
        if (!c.opacities) scene.opacities.clear();
    }
    ViewsCase c;
    PlainScene scene;
};

/// Whether rounding may decide about the splat, or about its radii.
bool fragile(const reference::PlainSplat& splat, const reference::PlainProjected& p,
             const ProjectionOptions& o) {
    const auto near = [](double a, double b) { return std::abs(a - b) <= 1e-4 * std::max(1.0, std::abs(b)); };
    const double peak = splat.opacity.value_or(1) * (o.compensations && splat.opacity ? p.compensation : 1);
    if (peak < 0.99 * shared::ALPHA_MIN) return false;
    bool close = near(p.depth, o.near) || near(p.depth, o.far) || near(peak * 255, 1);
    const double size[2] = {double(o.width), double(o.height)};
    for (int k = 0; k < 2; ++k) {
        const double radius = std::ceil(p.reach[k]);
        close = close || near(p.reach[k], std::round(p.reach[k])) || near(p.mean2d[k] + radius, 0) ||
                near(p.mean2d[k] - radius, size[k]);
    }
    return close;
}

TEST_P(ViewsPass, OutputsMatchTheReference) {
    const ProjectedSplats out = operators().project(scene.splats(), scene.view_arrays(), scene.options);
    ASSERT_EQ(out.radii.size(), 2 * c.splats * c.views);
    ASSERT_EQ(out.compensations.size(), c.compensations ? c.splats * c.views : 0);
    double worst_mean = 0, worst_shape = 0, worst_compensation = 0;
    size_t visible = 0, doubtful = 0;
    for (size_t v = 0; v < c.views; ++v)
        for (size_t i = 0; i < c.splats; ++i) {
            SCOPED_TRACE("view " + std::to_string(v) + ", splat " + std::to_string(i));
            const size_t at = v * c.splats + i;
            const reference::PlainSplat splat = scene.splat(i);
            const auto p = reference::project(splat, scene.view(v), scene.reference_options());
            const bool shown = out.radii[2 * at] > 0;
            if (fragile(splat, p, scene.options)) {
                ++doubtful;
                if (!shown || !p.visible) continue;
            }
            ASSERT_EQ(shown, p.visible);
            if (!shown) {
                EXPECT_EQ(out.radii[2 * at + 1], 0);
                EXPECT_EQ(out.means2d[2 * at], 0);
                EXPECT_EQ(out.depths[at], 0);
                for (size_t k = 0; k < 3; ++k) EXPECT_EQ(out.conics[3 * at + k], 0);
                if (c.compensations) {
                    EXPECT_EQ(out.compensations[at], 0);
                }
                continue;
            }
            ++visible;
            for (size_t k = 0; k < 2; ++k) {
                EXPECT_NEAR(out.radii[2 * at + k], std::ceil(p.reach[int(k)]),
                            fragile(splat, p, scene.options));
                worst_mean = std::max(worst_mean, std::abs(out.means2d[2 * at + k] / p.mean2d[int(k)] - 1));
            }
            EXPECT_NEAR(out.depths[at] / p.depth, 1, 1e-7);
            // An error of xy counts as its share of the root of xx yy, and one of k as the shear that moves u by one.
            const double x = out.conics[3 * at], y = out.conics[3 * at + 2];
            const double skew =
                c.whiteners ? std::abs(p.conic.y) + p.conic.z / p.conic.x : std::sqrt(p.conic.x * p.conic.z);
            worst_shape = std::max({worst_shape, std::abs(x / p.conic.x - 1), std::abs(y / p.conic.z - 1),
                                    std::abs(out.conics[3 * at + 1] - p.conic.y) / skew});
            if (c.compensations)
                worst_compensation = std::max(
                    worst_compensation, std::abs(out.compensations[at] - p.compensation) / p.compensation);
        }
    printf("    %zu visible, %zu doubtful; mean %.1e, shape %.1e, compensation %.1e\n", visible, doubtful,
           worst_mean, worst_shape, worst_compensation);
    EXPECT_GT(visible, c.splats / 10);
    EXPECT_LT(doubtful, 10 + c.splats * c.views / 10);
    EXPECT_LT(worst_mean, 2e-7);
    EXPECT_LT(worst_shape, c.shape);
    EXPECT_LT(worst_compensation, c.shape);
}

/// A gradient that makes each output count alike, and one of zero for what the device does not see.
struct ScreenGradients {
    std::vector<float> means2d, depths, conics, compensations;
    ProjectedGradient arrays() const { return {means2d, depths, conics, compensations}; }
};

ScreenGradients random_gradients(const PlainScene& scene, const ProjectedSplats& out, uint64_t seed) {
    Random random(seed);
    ScreenGradients g;
    for (size_t at = 0; at < scene.size() * scene.views(); ++at) {
        const double size = std::max(1e-30f, out.conics[3 * at] + out.conics[3 * at + 2]);
        for (int k = 0; k < 2; ++k) g.means2d.push_back(float(random.normal()));
        g.depths.push_back(float(random.normal()));
        for (int k = 0; k < 3; ++k)
            g.conics.push_back(float(random.normal() / (scene.options.whiteners && k == 1 ? 1 : size)));
        if (scene.options.compensations)
            g.compensations.push_back(float(random.normal() / std::max(1e-3f, out.compensations[at])));
    }
    return g;
}

struct ExpectedGradient {
    std::vector<double> means, shapes, scales, matrices, matrix_sizes;  // sizes: sums of absolute shares
};

ExpectedGradient reference_gradient(const PlainScene& scene, const ProjectedSplats& out,
                                    const ScreenGradients& g) {
    const size_t n = scene.size(), width = scene.covariances.empty() ? 4 : 6;
    ExpectedGradient e;
    e.means.resize(3 * n);
    e.shapes.resize(width * n);
    e.scales.resize(3 * n);
    e.matrices.resize(16 * scene.views());
    e.matrix_sizes.resize(16 * scene.views());
    for (size_t v = 0; v < scene.views(); ++v)
        for (size_t i = 0; i < n; ++i) {
            const size_t at = v * n + i;
            if (out.radii[2 * at] == 0) continue;
            const reference::PlainGradient by =
                reference::project_backward(scene.splat(i), scene.view(v), scene.reference_options(),
                                            {{g.means2d[2 * at], g.means2d[2 * at + 1]},
                                             g.depths[at],
                                             {g.conics[3 * at], g.conics[3 * at + 1], g.conics[3 * at + 2]},
                                             g.compensations.empty() ? 0 : g.compensations[at]});
            for (size_t k = 0; k < 3; ++k) {
                e.means[3 * i + k] += by.splat.mean[int(k)];
                e.scales[3 * i + k] += by.splat.scale[int(k)];
            }
            for (size_t k = 0; k < width; ++k)
                e.shapes[width * i + k] += width == 6 ? by.splat.covariance[k] : by.splat.quaternion[k];
            for (int row = 0; row < 3; ++row)
                for (int column = 0; column < 4; ++column) {
                    const double share = column == 3 ? by.translation[row] : by.rotation[column][row];
                    e.matrices[16 * v + 4 * size_t(row) + size_t(column)] += share;
                    e.matrix_sizes[16 * v + 4 * size_t(row) + size_t(column)] += std::abs(share);
                }
        }
    return e;
}

/// Largest error of a splat's values, as a share of the largest of them.
double worst_of_rows(const std::vector<float>& actual, const std::vector<double>& expected, size_t width) {
    EXPECT_EQ(actual.size(), expected.size());
    double worst = 0;
    for (size_t row = 0; row < expected.size() / width; ++row) {
        double size = 1e-12, error = 0;
        for (size_t k = row * width; k < (row + 1) * width; ++k) {
            size = std::max(size, std::abs(expected[k]));
            error = std::max(error, std::abs(actual[k] - expected[k]));
            if (!std::isfinite(actual[k])) error = HUGE_VAL;
        }
        worst = std::max(worst, error / size);
    }
    return worst;
}

TEST_P(ViewsPass, GradientsMatchTheReference) {
    const ProjectedSplats out = operators().project(scene.splats(), scene.view_arrays(), scene.options);
    const ScreenGradients g = random_gradients(scene, out, 7);
    const SplatGradient actual = operators().project_backward(scene.splats(), scene.view_arrays(),
                                                              scene.options, out.radii, g.arrays(), true);
    const ExpectedGradient expected = reference_gradient(scene, out, g);
    const double means = worst_of_rows(actual.means, expected.means, 3),
                 shapes = c.covariances ? worst_of_rows(actual.covariances, expected.shapes, 6)
                                        : worst_of_rows(actual.quaternions, expected.shapes, 4),
                 scales = c.covariances ? 0 : worst_of_rows(actual.scales, expected.scales, 3);
    double views = 0;
    for (size_t k = 0; k < expected.matrices.size(); ++k) {
        const double error = std::abs(actual.view_matrices[k] - expected.matrices[k]);
        if (expected.matrix_sizes[k] == 0) {
            EXPECT_EQ(error, 0) << k;  // the last row
        } else {
            views = std::max(views, error / expected.matrix_sizes[k]);
        }
    }
    printf("    means %.1e, shapes %.1e, scales %.1e, views %.1e\n", means, shapes, scales, views);
    EXPECT_LT(means, c.gradient);
    EXPECT_LT(shapes, c.gradient);
    EXPECT_LT(scales, c.gradient);
    EXPECT_LT(views, 1e-6);
    const SplatGradient again = operators().project_backward(scene.splats(), scene.view_arrays(),
                                                             scene.options, out.radii, g.arrays(), true);
    EXPECT_EQ(actual.view_matrices, again.view_matrices);
    EXPECT_EQ(actual.means, again.means);
}

std::string views_case_name(const testing::TestParamInfo<ViewsCase>& tested) {
    return tested.param.name;
}

INSTANTIATE_TEST_SUITE_P(
    All, ViewsPass,
    testing::Values(
        ViewsCase{"ordinary", SplatKind::ordinary, 1000, 1, false, false, false, 0, 0.3f, 1e-5, 1e-4},
        ViewsCase{"several_views", SplatKind::mixed, 257, 3, false, true, true, 0, 0.3f, 1e-5, 1e-4},
        ViewsCase{"needles", SplatKind::needles, 500, 2, false, false, true, 0, 0.3f, 3e-5, 5e-4},
        ViewsCase{"bent_views", SplatKind::needles, 300, 2, false, false, true, 0.2, 0.3f, 3e-5, 5e-4},
        ViewsCase{"close", SplatKind::off_screen_and_close, 500, 1, false, true, false, 0, 0.3f, 1e-5, 1e-4},
        ViewsCase{"sub_pixel", SplatKind::sub_pixel, 500, 1, false, false, true, 0, 0.1f, 1e-5, 1e-4},
        ViewsCase{"covariances", SplatKind::ordinary, 300, 2, true, true, true, 0, 0.3f, 1e-5, 1e-4},
        ViewsCase{"bent_covariances", SplatKind::mixed, 300, 2, true, false, true, 0.2, 0.3f, 1e-5, 1e-4},
        ViewsCase{"thin_covariances", SplatKind::needles, 300, 1, true, false, false, 0, 0.3f, 1e-5, 1e-4},
        ViewsCase{"whiteners", SplatKind::mixed, 300, 2, false, true, true, 0, 0.3f, 3e-5, 5e-4, true},
        ViewsCase{"one_splat", SplatKind::ordinary, 1, 1, false, false, false, 0, 0.3f, 1e-5, 1e-4}),
    views_case_name);

}  // namespace
}  // namespace ewa::test
