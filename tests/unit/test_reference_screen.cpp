// SPDX-License-Identifier: Apache-2.0
// The reference of the operators' blending: against the reference of the trainer's, and against central differences.
#include "reference/screen.h"

#include <gtest/gtest.h>

#include "support/gradient_check.h"
#include "support/screen_splats.h"

namespace ewa::reference {
namespace {

constexpr Smoothing kSmooth[] = {{AlphaCut::none, false}, {AlphaCut::ramp, false}};

double loss(const test::ScreenScene& s, const Smoothing& smoothing) {
    const ScreenImage image = blend(s.splats, s.order, s.width, s.height, smoothing);
    double sum = 0;
    for (size_t i = 0; i < image.features.size(); ++i) sum += image.features[i] * s.features_gradient[i];
    for (size_t i = 0; i < image.alphas.size(); ++i) sum += image.alphas[i] * s.alphas_gradient[i];
    return sum;
}

ScreenValuesGradient gradient_of(const test::ScreenScene& s, const Smoothing& smoothing) {
    return blend_backward(s.splats, s.order, s.width, s.height, s.features_gradient, s.alphas_gradient,
                          smoothing);
}

void expect_differences(test::ScreenScene s, const Smoothing& smoothing) {
    const ScreenValuesGradient gradient = gradient_of(s, smoothing);
    const auto check = [&](const char* name, std::vector<double>& values,
                           const std::vector<double>& claimed) {
        std::vector<double> expected;
        for (size_t i = 0; i < values.size(); ++i)
            expected.push_back(test::best_central_difference([&] { return loss(s, smoothing); }, values[i],
                                                             claimed[i], 1e-4, 1e-6));
        EXPECT_TRUE(test::gradients_agree(claimed, expected, {1e-8, 1e-5, 1e-4, 1e-5})) << name;
    };
    check("means", s.splats.means2d, gradient.values.means2d);
    check("conics", s.splats.conics, gradient.values.conics);
    check("opacities", s.splats.opacities, gradient.values.opacities);
    check("features", s.splats.features, gradient.values.features);
    check("background", s.splats.background, gradient.values.background);
}

TEST(ReferenceScreen, GradientsMatchDifferences) {
    for (const bool whiteners : {false, true})
        for (const Smoothing& smoothing : kSmooth) {
            SCOPED_TRACE(whiteners ? "whiteners" : "conics");
            expect_differences(test::screen_scene(50, 9, test::SplatKind::ordinary, 2, whiteners, 13, 9),
                               smoothing);
            expect_differences(test::screen_scene(51, 7, test::SplatKind::mixed, 5, whiteners, 11, 7),
                               smoothing);
        }
}

TEST(ReferenceScreen, RgbIsThatOfTheTrainersReference) {
    test::ScreenScene s = test::screen_scene(60, 40, test::SplatKind::mixed, 3, true, 33, 21);
    std::vector<Projected> projected(s.splats.size());
    for (size_t i = 0; i < projected.size(); ++i) {
        const double ux = s.splats.conics[3 * i], k = s.splats.conics[3 * i + 1],
                     vy = s.splats.conics[3 * i + 2];
        Projected& p = projected[i];
        p.visible = s.radii[2 * i] > 0;
        p.mean2d = {s.splats.means2d[2 * i], s.splats.means2d[2 * i + 1]};
        p.c = 1 / (2 * vy * vy);
        p.b = k * p.c;
        p.det = p.c / (2 * ux * ux);
        p.a = (p.det + p.b * p.b) / p.c;
        p.opacity = s.splats.opacities[i];
        for (int c = 0; c < 3; ++c) p.color[c] = s.splats.features[3 * i + size_t(c)];
        p.z = s.depths[i];
    }
    const std::array<float, 3> background{float(s.splats.background[0]), float(s.splats.background[1]),
                                          float(s.splats.background[2])};
    const Instances lists = make_instances(projected, depth_order(projected), {s.width, s.height, 8, 8});
    const Blended expected = blend(projected, lists, background);
    const ScreenImage image = blend(s.splats, s.order, s.width, s.height);
    for (size_t i = 0; i < image.features.size(); ++i)
        ASSERT_NEAR(image.features[i], expected.color.values[i], 1e-12) << i;
    for (size_t i = 0; i < image.alphas.size(); ++i)
        ASSERT_NEAR(image.alphas[i], 1 - expected.transmittance.values[i], 1e-12) << i;

    Raster incoming(s.width, s.height, 3);
    incoming.values = s.features_gradient;
    s.alphas_gradient.assign(s.alphas_gradient.size(), 0.0);
    const BlendGradients trainers = blend_backward(projected, lists, expected, incoming);
    const ScreenValuesGradient own = gradient_of(s, {});
    for (size_t i = 0; i < projected.size(); ++i) {
        const ScreenGradient& g = trainers.splats[i];
        EXPECT_NEAR(own.values.means2d[2 * i], g.mean2d.x, 1e-9 * (1 + std::abs(g.mean2d.x)));
        EXPECT_NEAR(own.values.opacities[i], g.opacity, 1e-9 * (1 + std::abs(g.opacity)));
        EXPECT_NEAR(own.values.features[3 * i], g.color.x, 1e-9 * (1 + std::abs(g.color.x)));
        EXPECT_NEAR(own.absolute[2 * i + 1], g.absolute.y, 1e-9 * (1 + g.absolute.y));
    }
}

}  // namespace
}  // namespace ewa::reference
