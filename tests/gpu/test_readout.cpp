// SPDX-License-Identifier: Apache-2.0
// Images of rolling shutters, against the CPU reference and against the cameras of single rows.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "ewa/error.h"
#include "ewa/renderer.h"
#include "gpu/test_device.h"
#include "reference/render.h"
#include "scene/readout.h"
#include "support/gradient_check.h"
#include "support/image_difference.h"
#include "support/random_lens.h"
#include "support/random_scene.h"

namespace ewa::test {
namespace {

/// Of the usual kernel; tests/gradient has the others.
TEST(Readout, ImagesAreTheReferences) {
    for (const auto& [name, camera] : rolling_cameras(7100, 97, 61)) {
        SCOPED_TRACE(name);
        const Gaussians gaussians = gaussians_around(7101, 300, camera, 2);
        RenderOptions options;
        options.background = {0.1f, 0.3f, 0.2f};
        Renderer renderer(device(), gaussians, options);
        const Rendering actual = renderer.render(camera, true);
        const reference::Rendered expected = reference::render(gaussians, camera, options);
        size_t visible = 0;
        for (const auto& splat : expected.projected) visible += splat.visible;
        EXPECT_GT(visible, 60u);
        EXPECT_LT(largest_difference(actual.color, expected.blended.color, 2), 2e-5);
        EXPECT_EQ(renderer.skipped_nonfinite(), 0u);
    }
}

/// tests/gradient compares both with central differences.
TEST(Readout, GradientsAreTheReferences) {
    for (const auto& [name, camera] : rolling_cameras(7600, 41, 29)) {
        if (name == "bottom" || name == "right" || name == "fisheye") continue;
        SCOPED_TRACE(name);
        const Gaussians gaussians = gaussians_around(7601, 40, camera, 1);
        const Image target = random_target(7602, 41, 29);
        RenderOptions options;
        const LossGradient actual = loss_gradient(device(), gaussians, camera, target, options);
        const reference::ReferenceGradient expected =
            reference::loss_gradient(gaussians, camera, target, options);
        GradientTolerance tolerance;
        tolerance.cosine = 1e-6;
        tolerance.norm = 1e-3;
        tolerance.element_relative = 2e-3;
        tolerance.element_absolute = 2e-4;
        EXPECT_TRUE(splat_gradients_agree(actual.gradient, expected.gradient, tolerance));
        for (const auto part : {&CameraMotion::rotation, &CameraMotion::shift, &CameraMotion::readout_turn,
                                &CameraMotion::readout_shift}) {
            const glm::dvec3 &is = actual.camera.*part, &want = expected.camera.*part;
            EXPECT_LT(glm::length(is - want), 1e-4 * glm::length(want));
        }
        EXPECT_EQ(actual.camera.log_focal, 0);
    }
}

TEST(Readout, OfACameraAtRestIsThePinholesImage) {
    const Camera pinhole = random_camera(7300, 97, 61);
    Camera still = pinhole;
    still.readout = Readout{ReadoutFrom::left, pinhole.rotation, pinhole.translation};
    const Gaussians gaussians = random_gaussians(7301, 400, SplatKind::mixed, pinhole, 1);
    Renderer renderer(device(), gaussians, {});
    const Image expected = renderer.render(pinhole).color;
    EXPECT_EQ(largest_difference(renderer.render(still).color, expected), 0);
    // This takes the kernels of a rolling shutter.
    still.readout->translation.x += 1e-12;
    EXPECT_LT(largest_difference(renderer.render(still).color, expected), 1e-5);
    still.readout->translation.x += 0.2;
    EXPECT_GT(largest_difference(renderer.render(still).color, expected), 0.05);
}

/// Each row or column shows what the camera sees at its time. Splats of a few pixels bend a little across their rows, which a
/// footprint does not.
TEST(Readout, EachRowIsItsOwnCameras) {
    for (const auto& [name, camera] : rolling_cameras(7400, 97, 61)) {
        SCOPED_TRACE(name);
        const Gaussians gaussians = gaussians_around(7401, 250, camera, 1);
        Renderer renderer(device(), gaussians, {});
        const Image rolled = renderer.render(camera).color;
        const scene::ReadoutMotion motion = scene::readout_motion(camera);
        const bool rows = motion.slope.y != 0;
        double squares = 0, of_first = 0;
        const Image first = renderer.render(scene::at_share(camera, 0)).color;
        for (int at = 0; at < (rows ? camera.height : camera.width); ++at) {
            const double share = motion.first + (at + 0.5) * (motion.slope.x + motion.slope.y);
            const Image own = renderer.render(scene::at_share(camera, share)).color;
            for (int other = 0; other < (rows ? camera.width : camera.height); ++other) {
                const int x = rows ? other : at, y = rows ? at : other;
                for (int c = 0; c < 3; ++c) {
                    squares += std::pow(double(rolled.at(x, y)[c]) - double(own.at(x, y)[c]), 2);
                    of_first += std::pow(double(rolled.at(x, y)[c]) - double(first.at(x, y)[c]), 2);
                }
            }
        }
        const double values = 3.0 * camera.width * camera.height;
        EXPECT_LT(std::sqrt(squares / values), 0.01);
        EXPECT_GT(std::sqrt(of_first / values), 0.05);
    }
}

TEST(Readout, OthersAreRefused) {
    const Gaussians gaussians = random_gaussians(7501, 3, SplatKind::ordinary, random_camera(7500), 0);
    Renderer renderer(device(), gaussians, {});
    Camera camera = rolling_cameras(7500, 40, 30)[0].camera;
    camera.distortion.lens = Lens::equirectangular;
    EXPECT_THROW(renderer.render(camera), InputError);
    camera.distortion.lens = Lens::orthographic;
    EXPECT_THROW(renderer.render(camera), InputError);
    camera.distortion = {};
    camera.readout->rotation = glm::dmat3(-1, 0, 0, 0, -1, 0, 0, 0, 1) * camera.rotation;
    EXPECT_THROW(renderer.render(camera), InputError);
    RenderOptions points;
    points.points = true;
    Renderer of_points(device(), gaussians, points);
    EXPECT_THROW(of_points.render(rolling_cameras(7500, 40, 30)[0].camera), InputError);
}

}  // namespace
}  // namespace ewa::test
