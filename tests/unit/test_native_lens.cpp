// SPDX-License-Identifier: Apache-2.0
// Lenses that splats are rendered through: where they show points, and what a pixel sees.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <numbers>

#include "reference/lens.h"
#include "scene/lens.h"
#include "scene/native_lens.h"
#include "support/random_lens.h"
#include "support/random_scene.h"

namespace ewa::test {
namespace {

TEST(NativeLens, APixelSeesThePointsThatItShows) {
    for (const auto& [name, camera] : random_lenses(7100, 97, 61)) {
        SCOPED_TRACE(name);
        ASSERT_TRUE(scene::is_native(camera.distortion));
        Random random(7101);
        int blind = 0;
        for (int i = 0; i < 200; ++i) {
            const double x = random.uniform(0, 97), y = random.uniform(0, 61);
            const auto ray = scene::ray_of(camera, scene::lens_limit(camera), x, y);
            blind += !ray;
            if (!ray) continue;
            EXPECT_NEAR(glm::length(ray->direction), 1, 1e-12);
            const glm::dvec3 point = ray->origin + random.uniform(1, 9) * ray->direction;
            const auto pixel = scene::pixel_of(camera, scene::lens_limit(camera), point);
            ASSERT_TRUE(pixel);
            EXPECT_NEAR(pixel->x, x, 1e-6);
            EXPECT_NEAR(pixel->y, y, 1e-6);
            const reference::LensImage image = reference::lens_image(camera, point);
            ASSERT_TRUE(image.shown);
            EXPECT_NEAR(image.pixel.x, x, 1e-6);
            EXPECT_NEAR(image.pixel.y, y, 1e-6);
        }
        // The corners of a fisheye's image would be behind the camera, all round.
        EXPECT_LT(blind, name.starts_with("fisheye") ? 60 : 1);
    }
}

/// The reference's derivatives, against central differences of its own pixel.
TEST(NativeLens, TheReferencesDerivativesAreSlopes) {
    for (const auto& [name, camera] : random_lenses(7200, 97, 61)) {
        SCOPED_TRACE(name);
        Random random(7201);
        for (int i = 0; i < 50; ++i) {
            const auto ray = scene::ray_of(camera, scene::lens_limit(camera), random.uniform(0, 97),
                                           random.uniform(0, 61));
            if (!ray) continue;
            const glm::dvec3 point = ray->origin + random.uniform(1, 9) * ray->direction;
            const reference::LensImage at = reference::lens_image(camera, point);
            constexpr double kStep = 1e-5;
            for (int k = 0; k < 3; ++k) {
                glm::dvec3 step(0);
                step[k] = kStep;
                const reference::LensImage more = reference::lens_image(camera, point + step),
                                           less = reference::lens_image(camera, point - step);
                const glm::dvec2 slope = (more.pixel - less.pixel) / (2 * kStep);
                const double scale = 1 + glm::length(at.exact.x) + glm::length(at.exact.y);
                EXPECT_NEAR(slope.x, at.exact.x[k], 1e-6 * scale);
                EXPECT_NEAR(slope.y, at.exact.y[k], 1e-6 * scale);
                for (int c = 0; c < 3; ++c) {
                    const double bend = (more.jacobian.x[c] - less.jacobian.x[c]) / (2 * kStep);
                    EXPECT_NEAR(bend, at.hessian[0][size_t(c)][k], 1e-5 * scale);
                }
            }
        }
    }
}

TEST(NativeLens, LimitsAreWhereAModelFolds) {
    Camera camera = random_camera(7300, 100, 80);
    EXPECT_GT(scene::lens_limit(camera), 1e30);
    // r (1 - r^2 / 3) folds at r = 1.
    camera.distortion.k1 = -1.0 / 3;
    EXPECT_NEAR(scene::lens_limit(camera), 1, 0.05);
    EXPECT_FALSE(scene::pixel_of(camera, scene::lens_limit(camera), {1.5, 0, 1}));
    EXPECT_TRUE(scene::pixel_of(camera, scene::lens_limit(camera), {0.5, 0, 1}));
    EXPECT_FALSE(scene::pixel_of(camera, scene::lens_limit(camera), {0.5, 0, -1}));
    camera.distortion = {.k1 = -0.1, .lens = Lens::fisheye};
    camera.fx = camera.fy = 10;  // the image is wider than the lens sees
    EXPECT_NEAR(scene::lens_limit(camera), std::sqrt(1 / 0.3), 0.01);
    EXPECT_FALSE(scene::ray_of(camera, scene::lens_limit(camera), 0, 0));
}

}  // namespace
}  // namespace ewa::test
