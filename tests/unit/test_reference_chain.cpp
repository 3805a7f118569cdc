// SPDX-License-Identifier: Apache-2.0
// The whole chain, splats to loss and back, against central differences of the loss.
#include <gtest/gtest.h>

#include <cmath>

#include "reference/render.h"
#include "support/gradient_check.h"
#include "support/random_scene.h"

namespace ewa::reference {
namespace {

struct Chain {
    Camera camera;
    Values values;
    Image target;
    RenderOptions options;
    ReferenceOptions reference;

    double loss() const {
        const Rendered rendered = render(values, camera, options, reference);
        const Blended& blended = rendered.blended;
        if (reference.loss.depth > 0)
            return image_loss(blended.color, to_double(target)).loss +
                   reference.loss.depth *
                       depth_loss(blended.depth_sum, blended.transmittance, reference.depths).difference;
        if (reference.loss.alpha <= 0) return image_loss(rendered.blended.color, to_double(target)).loss;
        Raster alpha(target.width, target.height, 1), seen(target.width, target.height, 3);
        for (size_t i = 0; i < alpha.values.size(); ++i) {
            alpha.values[i] = target.pixels[4 * i + 3];
            for (size_t k = 0; k < 3; ++k) {
                const double behind = options.background[k];
                seen.values[3 * i + k] = behind + alpha.values[i] * (target.pixels[4 * i + k] - behind);
            }
        }
        return image_loss(rendered.blended.color, seen).loss +
               reference.loss.alpha * alpha_loss(rendered.blended.transmittance, alpha).difference;
    }
};

Values differences(Chain& chain, const Values& claimed) {
    Values out = zeros_like(chain.values);
    const auto fill = [&](std::vector<double> Values::*array) {
        for (size_t i = 0; i < (out.*array).size(); ++i)
            (out.*array)[i] = test::best_central_difference(
                [&] { return chain.loss(); }, (chain.values.*array)[i], (claimed.*array)[i], 1e-4, 1e-6);
    };
    fill(&Values::means);
    fill(&Values::quaternions);
    fill(&Values::log_scales);
    fill(&Values::opacity_logits);
    fill(&Values::sh);
    return out;
}

Chain random_chain(uint64_t seed, test::SplatKind kind, size_t count, int degree, Footprint kernel) {
    Chain chain;
    chain.camera = test::random_camera(seed, 21, 17);
    chain.values = test::random_gaussians(seed, count, kind, chain.camera, degree);
    chain.target = test::random_target(seed, 21, 17);
    chain.options = {{0.2f, 0.5f, 0.1f}, kernel, degree};
    chain.reference.smoothing = {AlphaCut::none, false};
    return chain;
}

void check(Chain chain) {
    const ReferenceGradient result =
        loss_gradient(chain.values, chain.camera, chain.target, chain.options, chain.reference);
    EXPECT_NEAR(result.loss, chain.loss(), 1e-14);
    EXPECT_TRUE(test::splat_gradients_agree(result.gradient, differences(chain, result.gradient),
                                            {1e-6, 1e-3, 1e-3, 1e-4}));
}

TEST(ReferenceChain, EveryKernelAndDegree) {
    for (int kernel = 0; kernel < 3; ++kernel)
        for (int degree = 0; degree <= 3; ++degree) {
            const uint64_t seed = uint64_t(10 * kernel + degree);
            SCOPED_TRACE(test::seed_text(seed) + ", kernel " + std::to_string(kernel) + ", degree " +
                         std::to_string(degree));
            check(random_chain(seed, test::SplatKind::ordinary, 8, degree, Footprint(kernel)));
        }
}

TEST(ReferenceChain, OffTheScreenAndClose) {
    for (uint64_t seed = 40; seed < 44; ++seed) {
        SCOPED_TRACE(test::seed_text(seed));
        check(random_chain(seed, test::SplatKind::off_screen_and_close, 12, 1, Footprint::peak));
    }
}

TEST(ReferenceChain, MixedWithTheRamp) {
    for (uint64_t seed = 60; seed < 63; ++seed) {
        SCOPED_TRACE(test::seed_text(seed));
        Chain chain = random_chain(seed, test::SplatKind::ordinary, 20, 0, Footprint::antialias);
        chain.reference.smoothing.cut = AlphaCut::ramp;
        check(chain);
    }
}

TEST(ReferenceChain, AlphaOfACutOutImage) {
    Chain chain = random_chain(70, test::SplatKind::ordinary, 12, 1, Footprint::peak);
    chain.target = test::cut_out(chain.target, 71);
    chain.reference.loss.alpha = 0.6;
    check(chain);
}

TEST(ReferenceChain, DepthMap) {
    for (const Footprint kernel : {Footprint::peak, Footprint::density}) {
        Chain chain = random_chain(74, test::SplatKind::ordinary, 12, 1, kernel);
        chain.reference.loss.depth = 0.6;
        chain.reference.depths = to_double(test::random_depths(75, 21, 17));
        check(chain);
    }
}

TEST(ReferenceChain, TheModelItselfWhereNothingJumps) {
    // With the hard cut the loss jumps wherever a pixel crosses the floor; small steps mostly meet no jump.
    Chain chain = random_chain(80, test::SplatKind::ordinary, 8, 1, Footprint::peak);
    chain.reference = {};
    check(chain);
}

TEST(ReferenceChain, SkippedSplatsChangeNothing) {
    const Camera camera = test::random_camera(7);
    Gaussians scene = test::random_gaussians(7, 20, test::SplatKind::ordinary, camera, 2);
    const Image target = test::random_target(7, camera.width, camera.height);
    const ReferenceGradient clean = loss_gradient(scene, camera, target, {});
    EXPECT_EQ(clean.rendered.skipped_nonfinite, 0u);
    scene.resize(22);
    for (float& q : scene.quaternions) q = q == 0 ? 1.0f : q;
    scene.means[3 * 20] = std::nanf("");
    scene.log_scales[3 * 21 + 1] = INFINITY;
    const ReferenceGradient with = loss_gradient(scene, camera, target, {});
    EXPECT_EQ(with.rendered.skipped_nonfinite, 2u);
    EXPECT_EQ(with.rendered.blended.color.values, clean.rendered.blended.color.values);
    for (const auto* array : {&with.gradient.means, &with.gradient.quaternions, &with.gradient.sh})
        for (double g : *array) EXPECT_TRUE(std::isfinite(g));
    EXPECT_EQ(with.gradient.means[60], 0);
    EXPECT_EQ(with.in_view[20], 0);
    ASSERT_EQ(with.in_view.size(), 22u);
    const TileGrid whole{camera.width, camera.height, camera.width, camera.height};
    for (size_t i = 0; i < 22; ++i)
        EXPECT_EQ(with.in_view[i] != 0, !covered_tiles(with.rendered.projected[i], whole).empty()) << i;
}

TEST(ReferenceChain, ExtremesStayFinite) {
    for (uint64_t seed = 0; seed < 10; ++seed)
        for (int kernel = 0; kernel < 3; ++kernel) {
            SCOPED_TRACE(test::seed_text(seed));
            const Camera camera = test::random_camera(seed);
            const Gaussians scene = test::random_gaussians(seed, 50, test::SplatKind::mixed, camera, 3);
            RenderOptions options;
            options.kernel = Footprint(kernel);
            const Image target = test::random_target(seed, camera.width, camera.height);
            const ReferenceGradient out = loss_gradient(scene, camera, target, options);
            EXPECT_TRUE(std::isfinite(out.loss));
            for (const auto* array :
                 {&out.gradient.means, &out.gradient.quaternions, &out.gradient.log_scales,
                  &out.gradient.opacity_logits, &out.gradient.sh})
                for (double g : *array) EXPECT_TRUE(std::isfinite(g));
        }
}

}  // namespace
}  // namespace ewa::reference
