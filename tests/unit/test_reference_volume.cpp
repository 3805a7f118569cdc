// SPDX-License-Identifier: Apache-2.0
// The integral along a ray against what it is in closed form.
#include "reference/volume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "reference/render.h"

namespace ewa::reference {
namespace {

// Four Gauss nodes between borders at most 1.5 standard deviations apart.
constexpr double kQuadrature = 2e-6;

Camera camera() {
    Camera c;
    c.width = c.height = 32;
    c.fx = c.fy = 40;
    c.cx = c.cy = 16;
    return c;
}

struct Ball {
    double z, radius, opacity;
    glm::dvec3 color;
};

/// Round splats on the optical axis.
Values balls(const std::vector<Ball>& all) {
    Values v;
    v.resize(all.size());
    for (size_t i = 0; i < all.size(); ++i) {
        v.means[3 * i + 2] = all[i].z;
        v.quaternions[4 * i] = 1;
        for (size_t k = 0; k < 3; ++k) {
            v.log_scales[3 * i + k] = std::log(all[i].radius);
            v.sh[3 * i + k] = (all[i].color[int(k)] - 0.5) / 0.28209479177387814;
        }
        v.opacity_logits[i] = std::log(all[i].opacity / (1 - all[i].opacity));
    }
    return v;
}

RenderOptions on_grey() {
    RenderOptions options;
    options.background = {0.25f, 0.25f, 0.25f};
    return options;
}

void expect_color(const glm::dvec3& actual, const glm::dvec3& expected, double tolerance) {
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(actual[k], expected[k], tolerance) << k;
}

TEST(Volume, ARayThroughTheCentreMeetsTheOpacity) {
    const glm::dvec3 color(0.9, 0.6, 0.1);
    const Volume volume(balls({{3, 0.2, 0.7, color}}), camera(), on_grey());
    expect_color(volume.exact(16, 16), 0.7 * color + 0.3 * glm::dvec3(0.25), kQuadrature);
}

TEST(Volume, ARayBesideItMeetsWhatTheGaussianLeaves) {
    const glm::dvec3 color(0.9, 0.6, 0.1);
    const Volume volume(balls({{3, 0.2, 0.7, color}}), camera(), on_grey());
    // 4 px off the axis: the ray passes the centre at a distance of 3 sin(atan(0.1)).
    const double apart = 3 * 0.1 / std::sqrt(1.01) / 0.2;
    const double alpha = 1 - std::exp(std::log(0.3) * std::exp(-apart * apart / 2));
    expect_color(volume.exact(20, 16), alpha * color + (1 - alpha) * glm::dvec3(0.25), kQuadrature);
}

TEST(Volume, SplatsApartAreOneBehindTheOther) {
    const glm::dvec3 red(1, 0, 0), blue(0, 0, 1);
    const Volume volume(balls({{6, 0.1, 0.5, blue}, {3, 0.1, 0.4, red}}), camera(), on_grey());
    expect_color(volume.exact(16, 16), 0.4 * red + 0.6 * 0.5 * blue + 0.3 * glm::dvec3(0.25), kQuadrature);
}

TEST(Volume, SplatsInOnePlaceMix) {
    const glm::dvec3 red(1, 0, 0), blue(0, 0, 1);
    const Volume volume(balls({{3, 0.1, 0.5, blue}, {3, 0.1, 0.75, red}}), camera(), on_grey());
    // Optical depths ln 2 and 2 ln 2: together 1/8 passes, and a third of what is emitted is blue.
    expect_color(volume.exact(16, 16), 7.0 / 8 * (red * 2.0 / 3.0 + blue / 3.0) + glm::dvec3(0.25 / 8),
                 kQuadrature);
}

TEST(Volume, MarchingComesNearerWithMoreSamples) {
    const Volume volume(
        balls({{3, 0.2, 0.7, {1, 0, 0}}, {3.2, 0.3, 0.6, {0, 1, 0}}, {5, 0.2, 0.8, {0, 0, 1}}}), camera(),
        on_grey());
    const glm::dvec3 exact = volume.exact(17, 15);
    constexpr double kBeyond = 1e-3;  // the marcher leaves out what lies beyond 3 standard deviations
    double last = 0.1;
    for (const int samples : {8, 32, 128, 512}) {
        const double error = glm::length(volume.marched(17, 15, samples) - exact);
        EXPECT_LT(error, std::max(last, kBeyond));
        last = error;
    }
    EXPECT_LT(last, kBeyond);
}

/// A cigar along z, three times as long as wide, seen from a far camera that looks along `forward`.
double opacity_of_cigar(const glm::dvec3& forward, Footprint kernel) {
    Values cigar = balls({{0, 0.1, 0.5, {1, 1, 1}}});
    cigar.log_scales[2] = std::log(0.3);
    Camera far = camera();
    const glm::dvec3 right = std::abs(forward.x) > 0.5 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
    far.rotation = glm::transpose(glm::dmat3(right, glm::cross(forward, right), forward));
    far.translation = {0, 0, 100};
    RenderOptions options;
    options.kernel = kernel;
    return Volume(cigar, far, options).exact(16, 16).x;
}

TEST(Volume, ADensityAbsorbsMoreAlongALongerChord) {
    const glm::dvec3 x(1, 0, 0), z(0, 0, 1);
    EXPECT_NEAR(opacity_of_cigar(x, Footprint::peak), 0.5, kQuadrature);
    EXPECT_NEAR(opacity_of_cigar(z, Footprint::peak), 0.5, kQuadrature);
    const double along = -std::log1p(-opacity_of_cigar(z, Footprint::density)),
                 across = -std::log1p(-opacity_of_cigar(x, Footprint::density));
    EXPECT_NEAR(along / across, 3, 20 * kQuadrature);
    // Shadows 0.01 along z, 0.03 along x and y: their root mean square is sqrt(19 / 3) of the first.
    EXPECT_NEAR(along, std::log(2) * std::sqrt(19.0 / 3), 10 * kQuadrature);
}

TEST(Volume, ASphereIsTheSameWithBothKernels) {
    RenderOptions density = on_grey();
    density.kernel = Footprint::density;
    const Values ball = balls({{3, 0.2, 0.7, {0.9, 0.6, 0.1}}});
    for (const double x : {16.0, 19.0})
        expect_color(Volume(ball, camera(), density).exact(x, 15),
                     Volume(ball, camera(), on_grey()).exact(x, 15), kQuadrature);
}

/// Turned ellipsoids beside, before and within one another.
Values crowd() {
    Values v = balls({{3, 0.2, 0.7, {1, 0, 0}},
                      {3.2, 0.3, 0.6, {0, 1, 0}},
                      {3.1, 0.15, 0.97, {1, 1, 0}},
                      {5, 0.4, 0.8, {0, 0, 1}}});
    for (size_t i = 0; i < v.size(); ++i) {
        v.means[3 * i] = 0.2 * double(i) - 0.3;
        v.means[3 * i + 1] = 0.1 * double(i % 2);
        v.log_scales[3 * i + i % 3] += 1;
        for (size_t k = 1; k < 4; ++k) v.quaternions[4 * i + k] = 0.3 * double((i + k) % 3) - 0.2;
    }
    return v;
}

TEST(Volume, WithAllApproximationsItIsSplatting) {
    const Approximations all{true, true, true, true, true, true};
    for (const Footprint kernel : {Footprint::peak, Footprint::density}) {
        RenderOptions options = on_grey();
        options.kernel = kernel;
        Values values = crowd();
        // No density reaches the clamp of alpha.
        if (kernel == Footprint::density)
            for (double& logit : values.opacity_logits) logit -= 1;
        const Volume volume(values, camera(), options, all);
        const Rendered splatted = render(values, camera(), options);
        for (int y = 0; y < 32; y += 3)
            for (int x = 0; x < 32; x += 3) {
                const double* expected = splatted.blended.color.at(x, y);
                expect_color(volume.exact(x + 0.5, y + 0.5), {expected[0], expected[1], expected[2]}, 1e-12);
            }
    }
}

TEST(Volume, EachApproximationChangesTheImage) {
    const Volume exact(crowd(), camera(), on_grey());
    bool Approximations::*const flags[] = {&Approximations::overlap,  &Approximations::order,
                                           &Approximations::formula,  &Approximations::affine,
                                           &Approximations::low_pass, &Approximations::cut_off};
    for (const auto flag : flags) {
        Approximations one;
        one.*flag = true;
        const Volume changed(crowd(), camera(), on_grey(), one);
        double largest = 0;
        for (int y = 0; y < 32; y += 3)
            for (int x = 0; x < 32; x += 3)
                largest = std::max(
                    largest, glm::length(changed.exact(x + 0.5, y + 0.5) - exact.exact(x + 0.5, y + 0.5)));
        EXPECT_GT(largest, 1e-3);
        EXPECT_LT(largest, 0.5);
    }
}

}  // namespace
}  // namespace ewa::reference
