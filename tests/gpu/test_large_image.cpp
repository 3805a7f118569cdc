// SPDX-License-Identifier: Apache-2.0
// A picture with more tiles than some drivers allow turns of a loop (65,535, silently), and splats that cover
// all of it: no kernel may walk a splat's tiles, or a tile's splats, in one loop that long.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "ewa/renderer.h"
#include "gpu/test_device.h"
#include "reference/render.h"
#include "support/gradient_check.h"
#include "support/random_scene.h"

namespace ewa::test {
namespace {

/// Splats about as large as the picture, one behind the other.
Gaussians huge_splats(const Camera& camera, size_t count) {
    Gaussians g = random_gaussians(5, count, SplatKind::ordinary, camera, 0);
    for (size_t i = 0; i < count; ++i) {
        const double z = 1.0 + double(i);
        const glm::dvec3 mean =
            camera.position() + glm::transpose(camera.rotation) * glm::dvec3(0.1, -0.05, z);
        const float size = float(std::log(0.6 * z * camera.width / camera.fx));
        for (int c = 0; c < 3; ++c) {
            g.means[3 * i + size_t(c)] = float(mean[c]);
            g.log_scales[3 * i + size_t(c)] = size + 0.3f * float(c);
        }
        g.opacity_logits[i] = 0.0f;
    }
    return g;
}

TEST(LargeImage, SplatsOverMoreTilesThanALoopHasTurns) {
    const int width = 2056, height = 2200;  // 257 x 275 = 70,675 tiles of 8 x 8
    const Camera camera = random_camera(3, width, height);
    const Gaussians gaussians = huge_splats(camera, 3);
    const Image target = random_target(4, width, height);
    const RenderOptions options;
    const LossGradient actual = loss_gradient(unchecked_device(), gaussians, camera, target, options);
    const auto expected = reference::loss_gradient(gaussians, camera, target, options);
    EXPECT_NEAR(actual.loss, expected.loss, 1e-5);
    // Sums over 4.5 million pixels: float32 keeps about 1e-4 of them.
    GradientTolerance tolerance{1e-6, 5e-4, 1e-2, 1e-3};
    EXPECT_TRUE(splat_gradients_agree(actual.gradient, expected.gradient, tolerance));

    const Rendering rendering = Renderer(unchecked_device(), gaussians, options).render(camera);
    double worst = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < 3; ++c)
                worst = std::max(worst, std::abs(rendering.color.at(x, y)[c] -
                                                 expected.rendered.blended.color.at(x, y)[c]));
    EXPECT_LT(worst, 1.0 / 255 + 1e-5);
    EXPECT_GT(rendering.alpha.at(width - 1, height - 1)[0], 0.0f);
}

}  // namespace
}  // namespace ewa::test
