// SPDX-License-Identifier: Apache-2.0
// The operators of projection against the CPU reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "ewa/error.h"
#include "ewa/operators.h"
#include "gpu/guarded.h"
#include "passes/passes.h"
#include "support/gradient_check.h"
#include "support/plain_splats.h"
#include "support/temp_folder.h"

namespace ewa::test {
namespace {

inline SharedByTests<Operators>* const view_operators_of_all = SharedByTests<Operators>::add();
Operators& view_operators() {
    return view_operators_of_all->get([] { return Operators(device()); });
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
    float near = 0.01f, far = 1e10f, radius_clip = 0;
    Distortion lens{};  // of all views but the second, which is a pinhole
};

class ViewsPass : public testing::TestWithParam<ViewsCase> {
  protected:
    ViewsPass() : c(GetParam()) {
        scene = plain_scene(70 + c.splats, c.splats, c.kind, c.views, 160, 120, c.bend);
        scene.options.low_pass = c.low_pass;
        scene.options.compensations = c.compensations;
        scene.options.whiteners = c.whiteners;
        scene.options.near = c.near;
        scene.options.far = c.far;
        scene.options.radius_clip = c.radius_clip;
        if (c.covariances) scene.use_covariances();
        if (!c.opacities) scene.opacities.clear();
        if (!c.lens.none()) {
            scene.lenses.assign(c.views, c.lens);
            if (c.views > 1) scene.lenses[1] = {};
        }
        if (c.lens.lens == Lens::orthographic)  // px per world unit
            for (size_t v = 0; v < c.views; ++v)
                for (const size_t k : {0, 4}) scene.intrinsics[9 * v + k] /= 5;
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
    const ProjectedSplats out = view_operators().project(scene.splats(), scene.view_arrays(), scene.options);
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
    const ProjectedSplats out = view_operators().project(scene.splats(), scene.view_arrays(), scene.options);
    const ScreenGradients g = random_gradients(scene, out, 7);
    const SplatGradient actual = view_operators().project_backward(
        scene.splats(), scene.view_arrays(), scene.options, out.radii, g.arrays(), true);
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
    const SplatGradient again = view_operators().project_backward(scene.splats(), scene.view_arrays(),
                                                                  scene.options, out.radii, g.arrays(), true);
    EXPECT_EQ(actual.view_matrices, again.view_matrices);
    EXPECT_EQ(actual.means, again.means);
}

std::string views_case_name(const testing::TestParamInfo<ViewsCase>& tested) {
    return tested.param.name;
}

constexpr Distortion kBrown{.k1 = -0.28, .k2 = 0.09, .p1 = 0.004, .p2 = -0.003, .k3 = -0.01, .s1 = 0.002};
constexpr Distortion kFisheye{.k1 = 0.03, .k2 = -0.02, .k3 = 0.004, .lens = Lens::fisheye};

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
        ViewsCase{"planes_and_clip", SplatKind::ordinary, 1000, 2, false, false, false, 0, 0.3f, 3e-5, 5e-4,
                  false, 3, 6, 12},
        ViewsCase{"brown", SplatKind::mixed, 500, 2, false, true, true, 0, 0.3f, 3e-5, 5e-4, true, 0.01f,
                  1e10f, 0, kBrown},
        ViewsCase{"brown_covariances", SplatKind::off_screen_and_close, 800, 1, true, false, true, 0, 0.3f,
                  3e-5, 5e-4, false, 0.01f, 1e10f, 0, kBrown},
        ViewsCase{"fisheye", SplatKind::ordinary, 500, 2, false, false, true, 0.2, 0.3f, 3e-5, 5e-4, false,
                  0.01f, 1e10f, 0, kFisheye},
        ViewsCase{"orthographic", SplatKind::ordinary, 500, 2, true, true, false, 0, 0.3f, 3e-5, 5e-4, false,
                  0.01f, 1e10f, 0, Distortion{.lens = Lens::orthographic}},
        ViewsCase{"two_reductions", SplatKind::ordinary, 40000, 1, false, false, false, 0, 0.3f, 3e-5, 1e-3},
        ViewsCase{"one_splat", SplatKind::ordinary, 1, 1, false, false, false, 0, 0.3f, 1e-5, 1e-4}),
    views_case_name);

/// One view along z, at the origin, and splats that are given one by one.
PlainScene empty_scene() {
    PlainScene scene;
    scene.options.width = 64;
    scene.options.height = 48;
    scene.view_matrices = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    scene.intrinsics = {50, 0, 32, 0, 60, 24, 0, 0, 1};
    return scene;
}

void add_splat(PlainScene& scene, std::array<float, 3> mean, std::array<float, 4> quaternion,
               std::array<float, 3> scale) {
    scene.means.insert(scene.means.end(), mean.begin(), mean.end());
    scene.quaternions.insert(scene.quaternions.end(), quaternion.begin(), quaternion.end());
    scene.scales.insert(scene.scales.end(), scale.begin(), scale.end());
}

ProjectedSplats project_scene(const PlainScene& scene) {
    return view_operators().project(scene.splats(), scene.view_arrays(), scene.options);
}

/// Compares shapes and gradients of splats that are all visible. shape, gradient: largest relative errors; a gradient of 0 is
/// not compared.
void expect_reference(const PlainScene& scene, double shape, double gradient) {
    const ProjectedSplats out = project_scene(scene);
    for (size_t i = 0; i < scene.size(); ++i) {
        const auto p = reference::project(scene.splat(i), scene.view(0), scene.reference_options());
        ASSERT_TRUE(p.visible) << i;
        for (size_t k = 0; k < 2; ++k)
            EXPECT_NEAR(out.radii[2 * i + k] / std::min(std::ceil(p.reach[int(k)]), shared::RADIUS_MAX), 1,
                        1e-5)
                << i;
        EXPECT_NEAR(out.conics[3 * i] / p.conic.x, 1, shape) << i;
        EXPECT_NEAR(out.conics[3 * i + 2] / p.conic.z, 1, shape) << i;
        const double skew = scene.options.whiteners ? std::abs(p.conic.y) + p.conic.z / p.conic.x
                                                    : std::sqrt(p.conic.x * p.conic.z);
        EXPECT_NEAR((out.conics[3 * i + 1] - p.conic.y) / skew, 0, shape) << i;
    }
    if (gradient == 0) return;
    const ScreenGradients g = random_gradients(scene, out, 3);
    const SplatGradient actual = view_operators().project_backward(
        scene.splats(), scene.view_arrays(), scene.options, out.radii, g.arrays(), false);
    const ExpectedGradient expected = reference_gradient(scene, out, g);
    EXPECT_TRUE(actual.view_matrices.empty());
    EXPECT_LT(worst_of_rows(actual.means, expected.means, 3), gradient);
    if (scene.covariances.empty()) {
        EXPECT_LT(worst_of_rows(actual.quaternions, expected.shapes, 4), gradient);
        EXPECT_LT(worst_of_rows(actual.scales, expected.scales, 3), gradient);
    } else {
        EXPECT_LT(worst_of_rows(actual.covariances, expected.shapes, 6), gradient);
    }
}

/// Without coefficients, brown is a pinhole.
TEST(ViewsEdges, LensesThatBendNothing) {
    PlainScene scene = plain_scene(5, 200, SplatKind::ordinary, 1, 160, 120);
    const ProjectedSplats pinhole = project_scene(scene);
    scene.lenses = {Distortion{}};
    EXPECT_EQ(project_scene(scene).means2d, pinhole.means2d);
    scene.lenses = {Distortion{.k6 = 1e-30}};
    const ProjectedSplats brown = project_scene(scene);
    EXPECT_EQ(brown.radii, pinhole.radii);
    for (size_t k = 0; k < brown.means2d.size(); ++k)
        EXPECT_NEAR(brown.means2d[k], pinhole.means2d[k], 1e-6 * (1 + std::abs(pinhole.means2d[k])));
    scene.lenses = {Distortion{.lens = Lens::equirectangular}};
    expect_error<InputError>([&] { project_scene(scene); }, {"lenses", "brown", "orthographic"});
    scene.lenses.resize(2);
    expect_error<InputError>([&] { project_scene(scene); }, {"lenses", "[C]"});
}

/// The image of this lens turns back at x / z = 0.82, and x / z = 1.5 would be within it.
TEST(ViewsEdges, NothingIsSeenBeyondTheFold) {
    PlainScene scene = empty_scene();
    for (const float x : {0.5f, 3.0f, 6.0f}) add_splat(scene, {x, 0, 4}, {1, 0, 0, 0}, {0.1f, 0.1f, 0.1f});
    scene.lenses = {Distortion{.k1 = -0.5}};
    const ProjectedSplats out = project_scene(scene);
    EXPECT_GT(out.radii[0], 0);
    EXPECT_GT(out.radii[2], 0);
    EXPECT_EQ(out.radii[4], 0);
}

TEST(ViewsEdges, NoSplatsAndNoViews) {
    PlainScene scene = empty_scene();
    EXPECT_TRUE(project_scene(scene).radii.empty());
    const SplatGradient none =
        view_operators().project_backward(scene.splats(), scene.view_arrays(), scene.options, {}, {}, true);
    EXPECT_TRUE(none.means.empty());
    EXPECT_EQ(none.view_matrices, std::vector<float>(16));
    add_splat(scene, {0, 0, 4}, {1, 0, 0, 0}, {1, 1, 1});
    const ViewArrays no_views;
    EXPECT_TRUE(view_operators().project(scene.splats(), no_views, scene.options).radii.empty());
    const SplatGradient zero =
        view_operators().project_backward(scene.splats(), no_views, scene.options, {}, {}, true);
    EXPECT_EQ(zero.means, std::vector<float>(3));
    EXPECT_EQ(zero.quaternions, std::vector<float>(4));
    EXPECT_EQ(zero.scales, std::vector<float>(3));
}

/// From a point to a million images wide; scales that differ by all that float32 has; quaternions of any norm.
TEST(ViewsEdges, SplatsOfAllSizes) {
    PlainScene scene = empty_scene();
    scene.options.whiteners = scene.options.compensations = true;
    for (const float size : {1e-3f, 1.0f, 1e6f, 1e10f, 1e14f})
        for (const float norm : {1e-20f, 1.0f, 1e20f})
            add_splat(scene, {0.3f, -0.2f, 4}, {0.5f * norm, -0.1f * norm, 0.7f * norm, 0.4f * norm},
                      {size, 0.3f * size, 0.1f * size});
    for (const auto& scale : {std::array{1.0f, 1.00001f, 0.99999f}, std::array{1.0f, 1e-6f, 1e-3f},
                              std::array{1e-8f, 1e4f, 1.0f}, std::array{-0.5f, 0.2f, 0.1f}})
        add_splat(scene, {0.3f, -0.2f, 4}, {0.5f, -0.1f, 0.7f, 0.4f}, scale);
    expect_reference(scene, 2e-5, 2e-3);
    scene.options.whiteners = false;
    expect_reference(scene, 2e-5, 0);
}

/// The gradient of a scale of zero is zero, but for the compensation, which float32 cannot tell.
TEST(ViewsEdges, FlatSplats) {
    PlainScene scene = empty_scene();
    add_splat(scene, {0.3f, -0.2f, 4}, {0.5f, -0.1f, 0.7f, 0.4f}, {0.5f, 0, 0.3f});
    add_splat(scene, {0.3f, -0.2f, 4}, {0.5f, -0.1f, 0.7f, 0.4f}, {0, 0, 0.3f});
    add_splat(scene, {0.3f, -0.2f, 4}, {0.5f, -0.1f, 0.7f, 0.4f}, {0, 1e-30f, 0});
    expect_reference(scene, 1e-5, 1e-4);
}

TEST(ViewsEdges, SingularAndScaledCovariances) {
    PlainScene scene = empty_scene();
    const std::array<float, 3> axes[] = {{0.5f, 0.25f, 1}, {0.75f, -0.5f, 0.125f}, {0, 0.5f, -0.25f}};
    const auto add = [&](float scale, std::initializer_list<int> columns, float z) {
        std::array<float, 6> sum{};
        for (const int c : columns) {
            const auto& a = axes[c];
            const float products[] = {a[0] * a[0], a[0] * a[1], a[0] * a[2],
                                      a[1] * a[1], a[1] * a[2], a[2] * a[2]};
            for (size_t k = 0; k < 6; ++k) sum[k] += scale * products[k];
        }
        scene.means.insert(scene.means.end(), {0.1f * z, -0.1f * z, z});
        scene.covariances.insert(scene.covariances.end(), sum.begin(), sum.end());
    };
    for (const float scale : {0x1p-40f, 0x1p-7f, 0x1p-6f, 0x1p1f}) {
        add(scale, {0, 1, 2}, 4);
        add(scale, {0, 1}, 4);  // exactly singular
        add(scale, {0}, 4);
        add(scale, {2}, 4);  // xx is zero
        add(scale, {}, 4);
    }
    scene.covariances.insert(scene.covariances.end(), {0, 0, 0, 0, 0, 0.25f});
    scene.means.insert(scene.means.end(), {0.25f, 0.5f, 4});
    expect_reference(scene, 1e-5, 1e-4);
    // A scene a million times smaller, seen from as near.
    PlainScene small = empty_scene();
    std::swap(scene, small);
    for (const std::initializer_list<int>& columns : {std::initializer_list<int>{0, 1, 2}, {0, 1}})
        add(0x1p-42f, columns, 0x1p-19f);
    scene.options.near = 1e-9f;
    scene.options.compensations = true;
    scene.means.resize(3);
    scene.covariances.resize(6);
    expect_reference(scene, 1e-5, 1e-4);
}

/// What float32 keeps of R mean + t, where both are large.
TEST(ViewsEdges, FarFromTheOrigin) {
    PlainScene scene = empty_scene();
    scene.view_matrices = {0.6f, 0, -0.8f, -(1 << 20), 0, 1, 0, 1 << 19, 0.8f, 0, 0.6f, 1 << 18, 0, 0, 0, 1};
    for (int i = 0; i < 50; ++i)
        add_splat(scene, {float(419430 + i) + 0.25f, float(-(1 << 19)) + 0.5f, -996149.0f}, {1, 0, 0, 0},
                  {1, 1, 1});
    scene.options.near = -1e9f;
    const ProjectedSplats out = project_scene(scene);
    int visible = 0;
    for (size_t i = 0; i < scene.size(); ++i) {
        const auto p = reference::project(scene.splat(i), scene.view(0), scene.reference_options());
        if (out.radii[2 * i] == 0 || std::abs(p.depth) < 0.5) continue;
        ++visible;
        EXPECT_NEAR(out.depths[i] / p.depth, 1, 1e-6) << i;
        EXPECT_NEAR(out.means2d[2 * i], p.mean2d.x, 1e-5 * (1 + std::abs(p.mean2d.x))) << i;
    }
    EXPECT_GT(visible, 5);
}

/// Each value in turn not finite: the splat is invisible, and has no gradient. The one after it is as it was.
TEST(ViewsEdges, PoisonIsInvisible) {
    PlainScene scene = empty_scene();
    const float inf = std::numeric_limits<float>::infinity(), nan = std::nanf("");
    for (int i = 0; i < 34; ++i) add_splat(scene, {0, 0, 4}, {1, 0.1f, 0.2f, 0.3f}, {0.1f, 0.2f, 0.3f});
    for (size_t v = 0; v < 11; ++v)
        for (size_t kind = 0; kind < 3; ++kind) {
            const size_t i = 3 * v + kind;
            float& value = v < 3    ? scene.means[3 * i + v]
                           : v < 7  ? scene.quaternions[4 * i + v - 3]
                           : v < 10 ? scene.scales[3 * i + v - 7]
                                    : scene.means[3 * i + 2];
            value = v < 10 ? (kind == 0 ? nan : kind == 1 ? inf : -inf) : 1e19f;
        }
    scene.options.far = 1e30f;
    for (size_t k = 0; k < 4; ++k) scene.quaternions[4 * 32 + k] = 0;
    for (const size_t i : {31, 32}) scene.means[3 * i + 2] = 4;
    scene.scales[3 * 31] = 1e19f;
    const ProjectedSplats out = project_scene(scene);
    for (size_t i = 0; i < 33; ++i) EXPECT_EQ(out.radii[2 * i], 0) << i;
    EXPECT_GT(out.radii[2 * 33], 0);
    const ScreenGradients g = random_gradients(scene, out, 1);
    const SplatGradient by = view_operators().project_backward(scene.splats(), scene.view_arrays(),
                                                               scene.options, out.radii, g.arrays(), true);
    for (size_t k = 0; k < 3 * 33; ++k) EXPECT_EQ(by.means[k], 0) << k;
    for (size_t k = 0; k < 4 * 33; ++k) EXPECT_EQ(by.quaternions[k], 0) << k;
    for (size_t k = 0; k < 3 * 33; ++k) EXPECT_EQ(by.scales[k], 0) << k;
    EXPECT_NE(by.scales[3 * 33], 0);
    for (const float value : by.view_matrices) EXPECT_TRUE(std::isfinite(value));
}

TEST(ViewsEdges, AMissingGradientIsZero) {
    PlainScene scene = plain_scene(3, 50, SplatKind::ordinary, 2, 64, 48);
    const ProjectedSplats out = project_scene(scene);
    const std::vector<float> two(200), one(100), three(300);
    ScreenGradients g = random_gradients(scene, out, 2);
    const auto back = [&](const ProjectedGradient& gradient) {
        return view_operators().project_backward(scene.splats(), scene.view_arrays(), scene.options,
                                                 out.radii, gradient, true);
    };
    back(g.arrays());  // leaves its gradients in the buffers
    const SplatGradient missing = back({.means2d = g.means2d}), zero = back({g.means2d, one, three, one});
    EXPECT_EQ(missing.means, zero.means);
    EXPECT_EQ(missing.scales, zero.scales);
    EXPECT_EQ(missing.view_matrices, zero.view_matrices);
    EXPECT_EQ(back({}).means, std::vector<float>(150));
}

/// Guards behind each array that the passes write.
TEST(ViewsEdges, NothingIsWrittenBehindAnArray) {
    Rig& r = rig();
    const size_t n = 129, c = 3, pairs = n * c;
    const PlainScene scene = plain_scene(9, n, SplatKind::ordinary, c, 64, 48);
    shared::ViewBlock block{};
    for (int k = 0; k < 9; ++k) block.rotation[k] = k % 4 == 0;
    block.translation[2] = 4;
    for (int k = 0; k < 2; ++k) block.focal_hi[k] = block.tan_max[k] = 50, block.tan_min[k] = -50;
    const Guarded views("views", std::vector(c, block)), means("means", scene.means),
        quaternions("quaternions", scene.quaternions), scales("scales", scene.scales);
    const Guarded radii("radii", 8 * pairs), means2d("means2d", 8 * pairs), depths("depths", 4 * pairs),
        conics("conics", 12 * pairs), compensations("compensations", 4 * pairs);
    const Guarded by_means("by means", 12 * n), by_quaternions("by quaternions", 16 * n),
        by_scales("by scales", 12 * n);
    const shared::ViewsPush push{uint32_t(n), uint32_t(c), {64, 48}, 0.01f, 1e10f, 0.3f, 0};
    const passes::Groups groups = passes::ProjectViewsBackward::Work::groups(r.config(), push);
    const size_t subgroups = groups[0] * groups[1] * (r.config().element_group / r.config().subgroup);
    const Guarded sums("view sums", 4 * shared::VIEW_GRADIENT_FLOATS * c * subgroups);
    r.run([&](gpu::Recording& recording) {
        const std::pair kernel(shared::SPEC_KERNEL, shared::KERNEL_ANTIALIAS);
        r.cache.get<passes::ProjectViews>({{kernel.first, kernel.second}, {shared::SPEC_MODE, 0}})
            .record(
                recording,
                {views, means, quaternions, scales, scales, radii, means2d, depths, conics, compensations},
                push);
        r.cache
            .get<passes::ProjectViewsBackward>(
                {{kernel.first, kernel.second}, {shared::SPEC_MODE, shared::VIEWS_GRADIENTS}})
            .record(recording,
                    {views, means, quaternions, scales, radii, means2d, depths, conics, compensations,
                     by_means, by_quaternions, by_scales, sums},
                    push);
    });
    expect_intact(
        {&radii, &means2d, &depths, &conics, &compensations, &by_means, &by_quaternions, &by_scales, &sums});
    for (const float sum : sums.read<float>()) ASSERT_FALSE(std::isnan(sum));
    for (const float value : by_means.read<float>()) ASSERT_FALSE(std::isnan(value));
}

template <class Call>
std::string message_of(Call call) {
    try {
        call();
    } catch (const InputError& error) {
        return error.what();
    }
    return "no error";
}

TEST(ViewsEdges, WrongArgumentsAreNamed) {
    PlainScene scene = empty_scene();
    add_splat(scene, {0, 0, 4}, {1, 0, 0, 0}, {1, 1, 1});
    const auto message = [&](auto change) {
        PlainScene changed = scene;
        change(changed);
        return message_of([&] { project_scene(changed); });
    };
    const auto expect = [&](const char* text, const std::string& actual) {
        EXPECT_NE(actual.find(text), std::string::npos) << actual;
    };
    expect("means has 4 values; its shape [N, 3]", message([](auto& s) { s.means.push_back(0); }));
    expect("quaternions has 3 values", message([](auto& s) { s.quaternions.pop_back(); }));
    expect("scales has 0 values", message([](auto& s) { s.scales.clear(); }));
    expect("covariances has 5 values", message([](auto& s) { s.covariances.resize(5); }));
    expect("one of them", message([](auto& s) { s.covariances.resize(6); }));
    expect("opacities has 2 values", message([](auto& s) { s.opacities.resize(2); }));
    expect("view_matrices has 17 values", message([](auto& s) { s.view_matrices.push_back(0); }));
    expect("intrinsics has 8 values", message([](auto& s) { s.intrinsics.pop_back(); }));
    expect("width and height", message([](auto& s) { s.options.height = 0; }));
    expect("low_pass", message([](auto& s) { s.options.low_pass = -1; }));
    expect("focal length of view 0", message([](auto& s) { s.intrinsics[4] = 0; }));
    expect("focal length of view 0", message([](auto& s) { s.intrinsics[0] = std::nanf(""); }));
    const std::vector<int32_t> radii = {1, 1};
    const std::vector<float> wrong(5);
    const auto back = [&](std::span<const int32_t> given, const ProjectedGradient& g) {
        return message_of([&] {
            view_operators().project_backward(scene.splats(), scene.view_arrays(), scene.options, given, g,
                                              false);
        });
    };
    expect("radii has 0 values", back({}, {}));
    expect("gradient of means2d has 5 values", back(radii, {.means2d = wrong}));
    expect("gradient of conics has 5 values", back(radii, {.conics = wrong}));
    expect("gradient of compensations has 5 values", back(radii, {.compensations = wrong}));
    EXPECT_EQ(back(radii, {}), "no error");
}

}  // namespace
}  // namespace ewa::test
