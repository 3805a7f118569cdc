// SPDX-License-Identifier: Apache-2.0
// Integration along rays: gradients against central differences, and pictures against the exact integral.
#include "reference/rays.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <memory>

#include "reference/render.h"
#include "reference/volume.h"
#include "support/gradient_check.h"
#include "support/random_lens.h"
#include "support/random_scene.h"

namespace ewa::reference {
namespace {

struct RayScene {
    Camera camera;
    Values values;
    Image target;
    RenderOptions options;
    Smoothing smoothing{AlphaCut::none, false};
    std::unique_ptr<Rays> fixed;  // the intervals of the unchanged scene

    double loss() const {
        const Rays rays(values, camera, options, smoothing, fixed.get());
        return image_loss(rays.blended().color, to_double(target)).loss;
    }
};

RayScene ray_scene(uint64_t seed, test::SplatKind kind, size_t count, Integrator integrator,
                   Footprint kernel) {
    RayScene scene;
    scene.camera = test::random_camera(seed, 19, 15);
    scene.values = test::random_gaussians(seed, count, kind, scene.camera, 1);
    scene.target = test::random_target(seed, 19, 15);
    scene.options = {
        .background = {0.2f, 0.5f, 0.1f}, .kernel = kernel, .integrator = integrator, .samples = 5};
    scene.fixed = std::make_unique<Rays>(scene.values, scene.camera, scene.options, scene.smoothing);
    return scene;
}

void check_gradient(RayScene scene) {
    const Values claimed =
        loss_gradient(scene.values, scene.camera, scene.target, scene.options, {.smoothing = scene.smoothing})
            .gradient;
    Values differences = zeros_like(scene.values);
    for (const auto array :
         {&Values::means, &Values::quaternions, &Values::log_scales, &Values::opacity_logits, &Values::sh})
        for (size_t i = 0; i < (differences.*array).size(); ++i)
            (differences.*array)[i] = test::best_central_difference(
                [&] { return scene.loss(); }, (scene.values.*array)[i], (claimed.*array)[i], 1e-4, 1e-6);
    EXPECT_TRUE(test::splat_gradients_agree(claimed, differences, {1e-6, 1e-4, 1e-3, 1e-4}));
}

TEST(ReferenceRays, GradientsAreDifferences) {
    for (const Integrator integrator : {Integrator::ray, Integrator::march})
        for (const Footprint kernel : {Footprint::peak, Footprint::density}) {
            SCOPED_TRACE(std::to_string(int(integrator)) + ", kernel " + std::to_string(int(kernel)));
            check_gradient(ray_scene(3, test::SplatKind::ordinary, 8, integrator, kernel));
            check_gradient(ray_scene(5, test::SplatKind::off_screen_and_close, 8, integrator, kernel));
        }
}

TEST(ReferenceRays, GradientsOfWidenedSplatsAreDifferences) {
    for (const test::SplatKind kind : {test::SplatKind::ordinary, test::SplatKind::sub_pixel})
        for (const Integrator integrator : {Integrator::ray, Integrator::fast_ray})
            check_gradient(ray_scene(7, kind, 8, integrator, Footprint::antialias));
}

/// Parallel rays begin beside the camera's position: they are not shot.
TEST(ReferenceRays, GradientsThroughLensesAreDifferences) {
    for (const Footprint kernel : {Footprint::peak, Footprint::antialias})
        for (const auto& [name, camera] : test::random_lenses(6900, 19, 15)) {
            if (camera.distortion.lens == Lens::orthographic) continue;
            SCOPED_TRACE(name);
            RayScene scene;
            scene.camera = camera;
            scene.values = test::gaussians_around(6901, 8, camera, 1);
            scene.target = test::random_target(6902, 19, 15);
            scene.options = {.kernel = kernel, .integrator = Integrator::ray};
            check_gradient(std::move(scene));
        }
}

/// A widened splat absorbs as much as before: over the plane, and where it is seen through.
TEST(ReferenceRays, WidenedSplatsAbsorbAsMuch) {
    Camera camera;
    camera.width = camera.height = 41;
    camera.fx = camera.fy = 60;
    camera.cx = camera.cy = 20.5;
    Values one;
    one.means = {0, 0, 4};
    one.quaternions = {0.9, 0.2, -0.3, 0.1};
    one.log_scales = {std::log(0.06), std::log(0.1), std::log(0.08)};
    one.opacity_logits = {-2};
    one.sh = {1, 1, 1};
    const auto absorbed = [&](Footprint kernel) {
        const Blended image =
            Rays(one, camera, {.kernel = kernel, .integrator = Integrator::ray}, {AlphaCut::none, false})
                .blended();
        double sum = 0;
        for (const double left : image.transmittance.values) sum += 1 - left;
        return sum;
    };
    EXPECT_NEAR(absorbed(Footprint::antialias) / absorbed(Footprint::peak), 1, 0.03);
}

/// The root mean square error of a march over some pixels.
double march_error(const Gaussians& gaussians, const Camera& camera, RenderOptions options, int samples) {
    options.integrator = Integrator::march;
    options.samples = samples;
    const Volume volume(gaussians, camera, options);
    const Blended rendered = Rays(gaussians, camera, options).blended();
    double sum = 0;
    for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
            const glm::dvec3 exact = volume.exact(x + 0.5, y + 0.5);
            for (int k = 0; k < 3; ++k) sum += std::pow(rendered.color.at(x, y)[k] - exact[k], 2);
        }
    return std::sqrt(sum / (3.0 * camera.width * camera.height));
}

TEST(ReferenceRays, AMarchConvergesToTheIntegral) {
    const Camera camera = test::random_camera(11, 24, 18);
    const Gaussians scene = test::random_gaussians(12, 60, test::SplatKind::ordinary, camera, 1);
    for (const Footprint kernel : {Footprint::peak, Footprint::density}) {
        const RenderOptions options{.background = {0.2f, 0.5f, 0.8f}, .kernel = kernel};
        const double coarse = march_error(scene, camera, options, 8),
                     fine = march_error(scene, camera, options, 64);
        EXPECT_LT(fine, coarse / 16);
        EXPECT_LT(march_error(scene, camera, options, 256), 2e-5);
    }
}

TEST(ReferenceRays, ASingleSplatIsExactWithOneInterval) {
    const Camera camera = test::random_camera(13, 24, 18);
    const Gaussians scene = test::random_gaussians(14, 1, test::SplatKind::ordinary, camera, 0);
    for (const Footprint kernel : {Footprint::peak, Footprint::density})
        EXPECT_LT(march_error(scene, camera, {.kernel = kernel}, 1), 3e-6);
}

}  // namespace
}  // namespace ewa::reference
