// SPDX-License-Identifier: Apache-2.0
// Images through lenses, against the CPU reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "ewa/error.h"
#include "ewa/renderer.h"
#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "gpu/test_device.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/frame_inputs.h"
#include "pipeline/frame_passes.h"
#include "reference/render.h"
#include "support/gradient_check.h"
#include "support/image_difference.h"
#include "support/random_lens.h"
#include "support/random_scene.h"

namespace ewa::test {
namespace {

TEST(Lens, ImagesAreTheReferences) {
    for (const uint64_t seed : {6100, 6200})
        for (const Footprint kernel : {Footprint::peak, Footprint::antialias, Footprint::density})
            for (const auto& [name, camera] : random_lenses(seed, 97, 61)) {
                SCOPED_TRACE(name);
                const Gaussians gaussians = gaussians_around(seed + 1, 300, camera, 2);
                RenderOptions options;
                options.kernel = kernel;
                options.background = {0.1f, 0.3f, 0.2f};
                Renderer renderer(device(), gaussians, options);
                const Rendering actual = renderer.render(camera, true);
                const reference::Rendered expected = reference::render(gaussians, camera, options);
                size_t visible = 0;
                for (const auto& splat : expected.projected) visible += splat.visible;
                EXPECT_GT(visible, 60u);
                EXPECT_LT(visible, name == "equirectangular" || name == "fisheye" ? 301u : 297u);
                EXPECT_LT(largest_difference(actual.color, expected.blended.color, 2), 2e-5);
                EXPECT_EQ(renderer.skipped_nonfinite(), 0u);
            }
}

/// tests/gradient compares both with central differences.
TEST(Lens, GradientsAreTheReferences) {
    for (const Footprint kernel : {Footprint::peak, Footprint::antialias, Footprint::density})
        for (const auto& [name, camera] : random_lenses(6600, 41, 29)) {
            SCOPED_TRACE(name);
            const Gaussians gaussians = gaussians_around(6601, 60, camera, 1);
            const Image target = random_target(6602, 41, 29);
            RenderOptions options;
            options.kernel = kernel;
            const LossGradient actual = loss_gradient(device(), gaussians, camera, target, options);
            const reference::ReferenceGradient expected =
                reference::loss_gradient(gaussians, camera, target, options);
            GradientTolerance tolerance;
            tolerance.cosine = 1e-6;
            tolerance.norm = 1e-3;
            tolerance.element_relative = 2e-3;
            tolerance.element_absolute = 2e-4;
            EXPECT_TRUE(splat_gradients_agree(actual.gradient, expected.gradient, tolerance));
            const auto list = [](const CameraMotion& m) {
                return std::vector<double>{m.rotation.x, m.rotation.y, m.rotation.z, m.log_focal,
                                           m.shift.x,    m.shift.y,    m.shift.z};
            };
            EXPECT_TRUE(gradients_agree(list(actual.camera), list(expected.camera), tolerance)) << "camera";
        }
}

/// The terms of a pinhole are zero. A term that changes nothing takes the kernels of a lens.
TEST(Lens, WithoutDistortionIsAPinhole) {
    const Camera pinhole = random_camera(6300, 97, 61);
    Camera lens = pinhole;
    lens.distortion.k3 = 1e-30;
    const Gaussians gaussians = random_gaussians(6301, 400, SplatKind::mixed, pinhole, 1);
    Renderer renderer(device(), gaussians, {});
    const Image expected = renderer.render(pinhole).color;
    EXPECT_LT(largest_difference(renderer.render(lens).color, expected), 1e-5);
    lens.distortion.k3 = 0.1;
    EXPECT_GT(largest_difference(renderer.render(lens).color, expected), 0.05);
}

/// A turn about the vertical axis moves the columns of a panorama round, across its seam. Tiles do not divide the width.
TEST(Lens, APanoramaHasNoSeam) {
    constexpr int kWidth = 100, kHeight = 50, kColumns = 37;
    const Camera camera = random_lenses(6400, kWidth, kHeight)[4].camera;
    ASSERT_EQ(camera.distortion.lens, Lens::equirectangular);
    Camera turned = camera;
    const double angle = 2 * glm::pi<double>() * kColumns / kWidth;
    // Columns of the matrix; a point moves to the right.
    const glm::dmat3 turn(std::cos(angle), 0, -std::sin(angle), 0, 1, 0, std::sin(angle), 0, std::cos(angle));
    turned.rotation = turn * camera.rotation;
    turned.translation = turn * camera.translation;
    const Gaussians gaussians = gaussians_around(6401, 400, camera, 0);
    Renderer renderer(device(), gaussians, {});
    const Image before = renderer.render(camera).color, after = renderer.render(turned).color;
    double worst = 0;
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            for (int c = 0; c < 3; ++c)
                worst = std::max(worst, std::abs(double(before.at(x, y)[c]) -
                                                 double(after.at((x + kColumns) % kWidth, y)[c])));
    EXPECT_LT(worst, 2e-4);
}

/// Weights count on both sides of the seam.
TEST(Lens, LargestWeightsOfAPanoramaAreTheReferences) {
    Rig& r = rig();
    const Camera camera = random_lenses(6800, 100, 50)[4].camera;
    // Large splats, whose tiles lie on both sides.
    Gaussians gaussians = gaussians_around(6801, 200, camera, 0);
    for (float& scale : gaussians.log_scales) scale += 1.5f;
    const pipeline::Model model = pipeline::upload_model(*device(), gaussians, 1, false);
    const gpu::Buffer block = camera_buffer(camera, r.config());
    GuardedFrame guarded(r.config(), {model.splats, 100, 50, 20000, false, false});
    const pipeline::Plan plan = pipeline::plan_for({});
    const pipeline::FrameInputs inputs = pipeline::inputs_of(block, camera, {});
    Guarded largest("largest", std::vector<float>(gaussians.size()));
    r.run([&](gpu::Recording& recording) {
        const pipeline::FramePasses on{{recording, r.cache}, plan, guarded.frame, inputs};
        on.contributions(on.forward(model), largest);
    });
    EXPECT_TRUE(largest.intact());
    ASSERT_LE(guarded.frame.read_counts().instances, 20000u);
    const reference::Rendered expected = reference::render(gaussians, camera, {});
    const std::vector<double> weights = reference::largest_weights(expected.projected, expected.instances);
    const auto actual = largest.read<float>();
    size_t off = 0;
    for (size_t i = 0; i < weights.size(); ++i) off += std::abs(actual[i] - weights[i]) > 1e-5;
    EXPECT_LE(off, 2u) << "of 200; a weight may stand on the other side of ALPHA_MIN";
}

TEST(Lens, OthersAreRefused) {
    const Gaussians gaussians = random_gaussians(6501, 3, SplatKind::ordinary, random_camera(6500), 0);
    Renderer renderer(device(), gaussians, {});
    Camera camera = random_camera(6500);
    camera.distortion = {.k1 = 0.9, .lens = Lens::fov};
    EXPECT_THROW(renderer.render(camera), InputError);
    camera.distortion = {.p1 = 0.01, .lens = Lens::fisheye};
    EXPECT_THROW(renderer.render(camera), InputError);
}

}  // namespace
}  // namespace ewa::test
