// SPDX-License-Identifier: Apache-2.0
// The integral along a ray against what it is in closed form.
#include "reference/volume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

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

}  // namespace
}  // namespace ewa::reference
