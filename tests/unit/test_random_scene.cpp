// SPDX-License-Identifier: Apache-2.0
// The generators make what they say, and the same for the same seed.
#include "support/random_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>

namespace ewa::test {
namespace {

TEST(RandomScene, SameSeedSameScene) {
    const Camera camera = random_camera(3);
    const Gaussians a = random_gaussians(3, 20, SplatKind::mixed, camera, 2);
    const Gaussians b = random_gaussians(3, 20, SplatKind::mixed, camera, 2);
    const Gaussians c = random_gaussians(4, 20, SplatKind::mixed, camera, 2);
    EXPECT_EQ(a.means, b.means);
    EXPECT_EQ(a.sh, b.sh);
    EXPECT_NE(a.means, c.means);
    EXPECT_EQ(random_target(5, 9, 7).pixels, random_target(5, 9, 7).pixels);
}

TEST(RandomScene, CamerasAreOddAndRigid) {
    for (uint64_t seed = 0; seed < 50; ++seed) {
        SCOPED_TRACE(seed_text(seed));
        const Camera camera = random_camera(seed);
        EXPECT_EQ(camera.width % 2, 1);
        EXPECT_EQ(camera.height % 2, 1);
        EXPECT_NEAR(glm::determinant(camera.rotation), 1, 1e-12);
        EXPECT_NE(camera.fx, camera.fy);
        EXPECT_GT(std::abs(camera.cx - camera.width * 0.5) + std::abs(camera.cy - camera.height * 0.5), 1e-3);
    }
}

TEST(RandomScene, KindsAreWhatTheySay) {
    const Camera camera = random_camera(8);
    const auto depth = [&](const Gaussians& g, size_t i) {
        return (camera.rotation * glm::dvec3(g.means[3 * i], g.means[3 * i + 1], g.means[3 * i + 2]) +
                camera.translation)
            .z;
    };
    const Gaussians needles = random_gaussians(1, 50, SplatKind::needles, camera, 0);
    for (size_t i = 0; i < needles.size(); ++i)
        EXPECT_NEAR(needles.log_scales[3 * i] - needles.log_scales[3 * i + 1], std::log(1000.0), 1e-4);
    const Gaussians small = random_gaussians(1, 50, SplatKind::sub_pixel, camera, 0);
    for (size_t i = 0; i < small.size(); ++i)
        EXPECT_LT(std::exp(small.log_scales[3 * i]) * camera.fx / depth(small, i), 0.1);
    const Gaussians close = random_gaussians(1, 50, SplatKind::off_screen_and_close, camera, 0);
    double nearest = 1e9;
    for (size_t i = 0; i < close.size(); ++i) nearest = std::min(nearest, depth(close, i));
    EXPECT_GT(nearest, 0.01);
    EXPECT_LT(nearest, 0.05);
    const Gaussians extreme = random_gaussians(1, 200, SplatKind::opacity_extremes, camera, 0);
    const auto [low, high] =
        std::minmax_element(extreme.opacity_logits.begin(), extreme.opacity_logits.end());
    EXPECT_NEAR(1 / (1 + std::exp(-double(*low))), 1e-4, 1e-8);
    EXPECT_NEAR(1 / (1 + std::exp(-double(*high))), 0.99999, 1e-8);
}

}  // namespace
}  // namespace ewa::test
