// SPDX-License-Identifier: Apache-2.0
// Projection against closed forms, long double and the limits it must hold.
#include "reference/projection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

#include "shared/constants.h"
#include "support/random_scene.h"

namespace ewa::reference {
namespace {

Camera plain_camera() {
    Camera camera;
    camera.width = 41;
    camera.height = 31;
    camera.fx = 100;
    camera.fy = 80;
    camera.cx = 20.5;
    camera.cy = 15.5;
    return camera;
}

Splat round_splat(const glm::dvec3& mean, double scale, double opacity) {
    Splat splat;
    splat.mean = mean;
    splat.quaternion = {1, 0, 0, 0};
    splat.log_scale = glm::dvec3(std::log(scale));
    splat.opacity_logit = std::log(opacity / (1 - opacity));
    return splat;
}

TEST(ReferenceProjection, RoundSplatOnTheAxis) {
    const Projected p = project(round_splat({0, 0, 4}, 0.2, 0.7), plain_camera(), {});
    ASSERT_TRUE(p.visible);
    EXPECT_DOUBLE_EQ(p.z, 4);
    EXPECT_NEAR(p.mean2d.x, 20.5, 1e-12);
    EXPECT_NEAR(p.mean2d.y, 15.5, 1e-12);
    EXPECT_NEAR(p.a, 25.3, 1e-12);  // (100 * 0.2 / 4)^2 + 0.3
    EXPECT_NEAR(p.b, 0, 1e-12);
    EXPECT_NEAR(p.c, 16.3, 1e-12);  // (80 * 0.2 / 4)^2 + 0.3
    EXPECT_NEAR(p.det, 25.3 * 16.3, 1e-9);
    EXPECT_NEAR(p.opacity, 0.7, 1e-12);
    EXPECT_NEAR(p.color.x, 0.5, 1e-12);
}

TEST(ReferenceProjection, KernelFactors) {
    const Splat splat = round_splat({0, 0, 4}, 0.2, 0.7);
    RenderOptions options;
    options.kernel = Footprint::antialias;
    EXPECT_NEAR(project(splat, plain_camera(), options).opacity, 0.7 * std::sqrt(25.0 * 16.0 / (25.1 * 16.1)),
                1e-12);
    // The optical depth of a sphere is that of its opacity; the low-pass spreads it.
    options.kernel = Footprint::density;
    EXPECT_NEAR(project(splat, plain_camera(), options).opacity,
                -std::log(0.3) * std::sqrt(25.0 * 16.0 / (25.3 * 16.3)), 1e-12);
}

TEST(ReferenceProjection, ADensityAbsorbsMoreAlongALongerChord) {
    Splat splat = round_splat({0, 0, 4}, 0.2, 0.3);
    splat.log_scale = {std::log(200.0), std::log(200.0), std::log(20.0)};
    RenderOptions options;
    options.kernel = Footprint::density;
    const auto depth = [&] { return project(splat, plain_camera(), options).opacity; };
    // A disc from its face and from its edge. Between them is A / shadow = sqrt(s1^2 + 2 s3^2) / (sqrt(3) s3).
    const double face = depth(), tau = -std::log(0.7), bulge = std::sqrt((1 + 0.01 + 0.01) / 3);
    EXPECT_NEAR(face, tau * bulge, 1e-6);
    std::swap(splat.log_scale.x, splat.log_scale.z);
    EXPECT_NEAR(depth(), 10 * face, 1e-5);
    // Off the axis the chord is longer than the view depth says: |J| has the view position's length.
    splat = round_splat({0.8, 0, 4}, 200, 0.3);
    EXPECT_NEAR(depth(), tau, 1e-6);
}

TEST(ReferenceProjection, CovarianceIsThatOfTheLinearisedPinhole) {
    // Sigma2 = J W Sigma W^T J^T with J by central differences of the pinhole itself, for splats within the
    // picture.
    for (uint64_t seed = 0; seed < 20; ++seed) {
        SCOPED_TRACE(test::seed_text(seed));
        const Camera camera = test::random_camera(seed);
        const Gaussians scene = test::random_gaussians(seed, 10, test::SplatKind::ordinary, camera, 0);
        for (size_t i = 0; i < scene.size(); ++i) {
            const Splat splat = read_splat(scene, i);
            ProjectionSteps steps;
            const Projected p = project(splat, camera, {}, &steps);
            if (!p.visible || !steps.slope_free.x || !steps.slope_free.y) continue;
            const auto pinhole = [&](const glm::dvec3& world) {
                const glm::dvec3 v = camera.rotation * world + camera.translation;
                return glm::dvec2(camera.fx * v.x / v.z + camera.cx, camera.fy * v.y / v.z + camera.cy);
            };
            glm::dvec2 sum_diagonal(0);
            double sum_b = 0;
            for (int k = 0; k < 3; ++k) {
                const glm::dvec3 axis = steps.rotation[k] * std::exp(splat.log_scale[k]);
                const double h = 1e-5;
                const glm::dvec2 column =
                    (pinhole(splat.mean + axis * h) - pinhole(splat.mean - axis * h)) / (2 * h);
                sum_diagonal += column * column;
                sum_b += column.x * column.y;
            }
            EXPECT_NEAR(p.a, sum_diagonal.x + 0.3, 1e-6 * p.a);
            EXPECT_NEAR(p.c, sum_diagonal.y + 0.3, 1e-6 * p.c);
            EXPECT_NEAR(p.b, sum_b, 1e-6 * std::sqrt(p.a * p.c));
        }
    }
}

TEST(ReferenceProjection, RotationTurnsTheAxesTheRightWay) {
    // A quarter turn about z takes x to y.
    const double half = std::sqrt(0.5);
    const glm::dmat3 r = rotation_matrix({half, 0, 0, half});
    EXPECT_NEAR(glm::length(r * glm::dvec3(1, 0, 0) - glm::dvec3(0, 1, 0)), 0, 1e-12);
    const glm::dmat3 rx = rotation_matrix({half, half, 0, 0});
    EXPECT_NEAR(glm::length(rx * glm::dvec3(0, 1, 0) - glm::dvec3(0, 0, 1)), 0, 1e-12);
    const glm::dmat3 ry = rotation_matrix({half, 0, half, 0});
    EXPECT_NEAR(glm::length(ry * glm::dvec3(0, 0, 1) - glm::dvec3(1, 0, 0)), 0, 1e-12);
}

TEST(ReferenceProjection, DeterminantOfNeedlesMatchesLongDouble) {
    for (uint64_t seed = 0; seed < 30; ++seed) {
        SCOPED_TRACE(test::seed_text(seed));
        const Camera camera = test::random_camera(seed);
        const Gaussians scene = test::random_gaussians(seed, 20, test::SplatKind::needles, camera, 0);
        for (size_t i = 0; i < scene.size(); ++i) {
            ProjectionSteps s;
            const Projected p = project(read_splat(scene, i), camera, {}, &s);
            if (!p.visible) continue;
            using real = long double;
            real xx = 0, xy = 0, yy = 0;
            for (int k = 0; k < 3; ++k) {
                xx += real(s.m.x[k]) * s.m.x[k];
                xy += real(s.m.x[k]) * s.m.y[k];
                yy += real(s.m.y[k]) * s.m.y[k];
            }
            const real det = (xx + 0.3L) * (yy + 0.3L) - xy * xy;
            EXPECT_NEAR(p.det / double(det), 1, 1e-12);
            EXPECT_GT(s.det0, 0);
            // The subtraction in long double leaves an error of its own, as large as its terms' rounding.
            EXPECT_NEAR(s.det0, double(xx * yy - xy * xy), 1e-17 * double(xx * yy) + 1e-12 * s.det0);
        }
    }
}

TEST(ReferenceProjection, SlopeIsClampedFarOffThePictureOnly) {
    Camera camera = plain_camera();
    camera.cx = 10;  // more picture on the right: the limits differ
    camera.cy = 22;
    const double low = -(10 / 100.0 + 0.3 * 41 / 200), high = 31 / 100.0 + 0.3 * 41 / 200;
    const double low_y = -(22 / 80.0 + 0.3 * 31 / 160), high_y = 9 / 80.0 + 0.3 * 31 / 160;
    const auto slope = [&](double x, double y) {
        ProjectionSteps s;
        EXPECT_TRUE(project(round_splat({2 * x, 2 * y, 2}, 0.2, 0.7), camera, {}, &s).visible);
        return s.slope;
    };
    EXPECT_NEAR(slope(-5, 0).x, low, 1e-12);
    EXPECT_NEAR(slope(5, 0).x, high, 1e-12);
    EXPECT_NEAR(slope(0, -5).y, low_y, 1e-12);
    EXPECT_NEAR(slope(0, 5).y, high_y, 1e-12);
    EXPECT_NEAR(slope(0.98 * high, 0.98 * low_y).x, 0.98 * high, 1e-12);
    EXPECT_NEAR(slope(0.98 * high, 0.98 * low_y).y, 0.98 * low_y, 1e-12);
    // The mean itself is not.
    EXPECT_NEAR(project(round_splat({10, 0, 2}, 0.2, 0.7), camera, {}).mean2d.x, 100 * 5 + 10, 1e-9);
    // The clamped slope stands in the third column alone: J = [f/z, 0, -f t/z].
    const Projected p = project(round_splat({10, 0, 2}, 0.2, 0.7), camera, {});
    EXPECT_NEAR(p.a, 0.04 * 2500 * (1 + high * high) + 0.3, 1e-9);
}

TEST(ReferenceProjection, QuaternionOfAnyNorm) {
    Splat splat = round_splat({0.1, 0.2, 4}, 0.2, 0.7);
    splat.log_scale = {-1, -2, -3};
    splat.quaternion = {0.5, -0.1, 0.7, 0.3};
    const Projected expected = project(splat, plain_camera(), {});
    for (double norm : {1e-20, 1e20, 1e-37, 1e200}) {
        Splat scaled = splat;
        for (double& q : scaled.quaternion) q *= norm;
        const Projected p = project(scaled, plain_camera(), {});
        ASSERT_TRUE(p.visible) << norm;
        EXPECT_NEAR(p.a, expected.a, 1e-12);
        EXPECT_NEAR(p.b, expected.b, 1e-12);
        EXPECT_NEAR(p.c, expected.c, 1e-12);
    }
    // What float32 takes for zero has no direction.
    for (double& q : splat.quaternion) q *= 1e-39;
    EXPECT_TRUE(project(splat, plain_camera(), {}).skipped_nonfinite);
}

TEST(ReferenceProjection, CulledByNearPlaneAndOpacity) {
    const auto visible = [](double z, double opacity) {
        const Projected p = project(round_splat({0, 0, z}, 0.2, opacity), plain_camera(), {});
        EXPECT_FALSE(p.skipped_nonfinite);
        return p.visible;
    };
    EXPECT_TRUE(visible(0.0101, 0.7));
    EXPECT_FALSE(visible(0.01, 0.7));
    EXPECT_FALSE(visible(-4, 0.7));
    EXPECT_TRUE(visible(4, 1.001 / 255));
    EXPECT_FALSE(visible(4, 0.999 / 255));
}

TEST(ReferenceProjection, NotFiniteIsSkippedWhereverItIs) {
    const double bad[] = {std::nan(""), std::numeric_limits<double>::infinity(),
                          -std::numeric_limits<double>::infinity()};
    const auto skipped = [](const Splat& splat) {
        const Projected p = project(splat, plain_camera(), {});
        EXPECT_FALSE(p.visible);
        return p.skipped_nonfinite;
    };
    for (double z : {4.0, -4.0}) {
        const Splat good = round_splat({0, 0, z}, 0.2, 0.7);
        EXPECT_EQ(project(good, plain_camera(), {}).visible, z > 0);
        for (double v : bad) {
            Splat s = good;
            s.mean.y = v;
            EXPECT_TRUE(skipped(s));
            s = good;
            s.quaternion[2] = v;
            EXPECT_TRUE(skipped(s));
            s = good;
            s.log_scale.z = v;
            EXPECT_TRUE(skipped(s));
            s = good;
            s.opacity_logit = v;
            EXPECT_TRUE(skipped(s));
        }
        Splat s = good;
        s.quaternion = {0, 0, 0, 0};
        EXPECT_TRUE(skipped(s));
    }
    Splat s = round_splat({0, 0, 4}, 0.2, 0.7);
    s.sh[0].y = std::nan("");
    EXPECT_TRUE(skipped(s));
    s = round_splat({0, 0, 4}, 0.2, 0.7);
    s.log_scale.x = 60;  // finite, but its square is beyond float32
    EXPECT_TRUE(skipped(s));
    s.log_scale.x = -300;
    EXPECT_FALSE(project(s, plain_camera(), {}).skipped_nonfinite);
    EXPECT_TRUE(project(s, plain_camera(), {}).visible);
}

TEST(ReferenceProjection, ColorOfEachDegreeIsClampedBelow) {
    Splat splat = round_splat({0.3, -0.2, 4}, 0.2, 0.7);
    splat.sh_degree = 3;
    const glm::dvec3 direction = glm::normalize(splat.mean);
    const auto basis = sh_basis(3, direction);
    for (int j = 0; j < kMaxCoefficients; ++j) splat.sh[j] = {0.1 * j, -0.05 * j, -3};
    for (int degree = 0; degree <= 3; ++degree) {
        RenderOptions options;
        options.sh_degree = degree;
        double sum = 0.5;
        for (int j = 0; j < sh_coefficients(degree); ++j) sum += basis[j] * 0.1 * j;
        const Projected p = project(splat, plain_camera(), options);
        EXPECT_NEAR(p.color.x, std::max(0.0, sum), 1e-12);
        if (degree == 0) {
            EXPECT_EQ(p.color.z, 0);
        }
    }
}

TEST(ReferenceProjection, DirectionIsFromTheCameraToTheMeanInWorldAxes) {
    Camera camera = test::random_camera(5);
    Splat splat =
        round_splat(camera.position() + glm::transpose(camera.rotation) * glm::dvec3(0.1, 0.2, 3), 0.2, 0.7);
    splat.sh_degree = 1;
    splat.sh[1] = glm::dvec3(0.2);
    ProjectionSteps s;
    ASSERT_TRUE(project(splat, camera, {}, &s).visible);
    const glm::dvec3 expected = glm::normalize(splat.mean - camera.position());
    EXPECT_NEAR(glm::length(s.direction - expected), 0, 1e-12);
    EXPECT_NEAR(s.raw_color.x, 0.5 - 0.2 * shared::SH_C1 * expected.y, 1e-12);
}

TEST(ReferenceHarmonics, OrthonormalOverTheSphere) {
    // A spiral of points, each for an equal area, integrates polynomials of degree 6 well.
    const int n = 200000;
    std::vector<double> gram(kMaxCoefficients * kMaxCoefficients, 0.0);
    for (int i = 0; i < n; ++i) {
        const double z = 1 - (2 * i + 1.0) / n, r = std::sqrt(1 - z * z);
        const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
        const auto y = sh_basis(3, {r * std::cos(angle), r * std::sin(angle), z});
        for (int j = 0; j < kMaxCoefficients; ++j)
            for (int k = 0; k < kMaxCoefficients; ++k)
                gram[j * kMaxCoefficients + k] += y[j] * y[k] * 4 * std::numbers::pi / n;
    }
    for (int j = 0; j < kMaxCoefficients; ++j)
        for (int k = 0; k < kMaxCoefficients; ++k)
            EXPECT_NEAR(gram[j * kMaxCoefficients + k], j == k ? 1 : 0, 1e-3) << j << " " << k;
}

TEST(ReferenceHarmonics, SignsAndOrderAreInrias) {
    // INRIA's signs at (1, 2, 3), one a coefficient.
    const auto y = sh_basis(3, glm::normalize(glm::dvec3(1, 2, 3)));
    const int signs[] = {1, -1, 1, -1, 1, -1, 1, -1, -1, 1, 1, -1, 1, -1, -1, 1};
    for (int j = 0; j < kMaxCoefficients; ++j) EXPECT_GT(y[j] * signs[j], 0) << j;
    // Along +z only the zonal ones (0, 2, 6, 12) are left.
    const auto up = sh_basis(3, {0, 0, 1});
    for (int j = 0; j < kMaxCoefficients; ++j) {
        const bool zonal = j == 0 || j == 2 || j == 6 || j == 12;
        EXPECT_EQ(std::abs(up[j]) > 1e-12, zonal) << j;
    }
    EXPECT_NEAR(sh_basis(1, {0, 1, 0})[1], -shared::SH_C1, 1e-15);
    EXPECT_NEAR(sh_basis(1, {1, 0, 0})[3], -shared::SH_C1, 1e-15);
    EXPECT_EQ(sh_basis(1, {0, 1, 0})[4], 0);
}

}  // namespace
}  // namespace ewa::reference
