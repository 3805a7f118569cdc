// SPDX-License-Identifier: Apache-2.0
// Training with Integrator::ray.
#include <gtest/gtest.h>

#include "ewa/error.h"
#include "ewa/evaluation.h"
#include "ewa/trainer.h"
#include "gpu/test_device.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

/// The mean PSNR of the training images after a run.
double psnr_after(const Dataset& dataset, const TrainOptions& options) {
    const auto frames = all_frames(dataset);
    Trainer trainer(device(), dataset, frames, shaken_start(small_capture(), 0.05, 1, 0), options);
    StepReport report;
    while (trainer.steps_done() < options.steps) report = trainer.step();
    EXPECT_EQ(report.dropped_updates, 0u);
    return evaluate(device(), trainer.gaussians(), dataset, frames, options.render).psnr;
}

TEST(RayTraining, LearnsAsWellAsFootprints) {
    for (const Strategy strategy : {Strategy::none, Strategy::adc, Strategy::mcmc}) {
        TrainOptions options = quick(240);
        options.strategy = strategy;
        options.max_splats = 80;
        options.render.kernel = Footprint::antialias;
        const double splat = psnr_after(small_capture().dataset, options);
        options.render.integrator = Integrator::fast_ray;
        const double ray = psnr_after(small_capture().dataset, options);
        printf("    %.2f dB by footprints, %.2f dB by rays\n", splat, ray);
        EXPECT_GT(ray, 25);
        EXPECT_GT(ray, splat - 2);  // the images are of footprints
    }
}

/// The strategy reads gradients of about the size that footprints have, so that a threshold means the same.
TEST(RayTraining, TheStrategyAddsAsManySplats) {
    uint32_t splats[2];
    for (const Integrator integrator : {Integrator::splat, Integrator::fast_ray}) {
        TrainOptions options = busy(Strategy::adc, 1);
        options.opacity_reset_every = 0;
        options.max_splats = 5000;
        options.grow_gradient = 4e-4;
        options.render.kernel = Footprint::antialias;
        options.render.integrator = integrator;
        Trainer trainer(device(), seven_views().dataset, all_frames(seven_views().dataset),
                        shaken_start(seven_views(), 0.02, 5, 1), options);
        while (trainer.steps_done() < options.steps) trainer.step();
        splats[integrator == Integrator::fast_ray] = trainer.splats();
    }
    printf("    %u splats by footprints, %u by rays\n", splats[0], splats[1]);
    EXPECT_GT(splats[0], 330u);
    EXPECT_GT(splats[1], 0.85 * splats[0]);
    EXPECT_LT(splats[1], 1.15 * splats[0]);
}

TEST(RayTraining, ResumesWithTheSameBytes) {
    for (const auto& [strategy, integrator] :
         {std::pair(Strategy::adc, Integrator::fast_ray), std::pair(Strategy::mcmc, Integrator::fast_ray),
          std::pair(Strategy::adc, Integrator::ray)}) {
        TrainOptions options = busy(strategy, 1);
        options.render.integrator = integrator;
        const Gaussians start = shaken_start(seven_views(), 0.02, 5, 1);
        const auto frames = all_frames(seven_views().dataset);
        Trainer whole(device(), seven_views().dataset, frames, start, options);
        while (whole.steps_done() < 33) whole.step();
        Trainer later(device(), seven_views().dataset, frames, start, options);
        later.restore(whole.state());
        for (Trainer* trainer : {&whole, &later})
            while (trainer->steps_done() < options.steps) trainer->step();
        EXPECT_EQ(later.gaussians().means, whole.gaussians().means);
        EXPECT_EQ(later.gaussians().sh, whole.gaussians().sh);
    }
}

/// Every third splat is outside all views, so that the numbers of those in a view are not those in the model.
TEST(RayTraining, DrawsWhatARendererDraws) {
    for (const Integrator integrator : {Integrator::ray, Integrator::fast_ray}) {
        TrainOptions options = quick(2);
        options.render.integrator = integrator;
        options.strategy = Strategy::none;
        const Dataset& dataset = small_capture().dataset;
        Gaussians start = shaken_start(small_capture(), 0.02, 12, 0);
        for (size_t i = 0; i < start.size(); i += 3) start.means[3 * i] += 50;
        Trainer trainer(device(), dataset, all_frames(dataset), start, options);
        trainer.step();
        const Camera& camera = dataset.frames[0].camera;
        Renderer renderer(device(), trainer.gaussians(), options.render);
        EXPECT_EQ(trainer.render({&camera, 1})[0].pixels, renderer.render(camera).color.pixels);
    }
}

TEST(RayTraining, LearnsThroughLenses) {
    for (const Lens lens : {Lens::fisheye, Lens::equirectangular, Lens::brown}) {
        Synthetic scene;
        put_lens(scene, {.k1 = lens == Lens::brown ? -0.1 : 0, .lens = lens});
        TrainOptions options = quick(240);
        const double splat = psnr_after(scene.dataset, options);
        options.render = {.kernel = Footprint::antialias, .integrator = Integrator::fast_ray};
        const double ray = psnr_after(scene.dataset, options);
        printf("    %.2f dB by footprints, %.2f dB by rays\n", splat, ray);
        EXPECT_GT(ray, splat - 3.5);
        EXPECT_GT(ray, 25);
    }
}

TEST(RayTraining, WhatHasNoGradientIsRefused) {
    const auto refused = [](auto change) {
        TrainOptions options = quick(6);
        options.render.integrator = Integrator::ray;
        change(options);
        EXPECT_THROW(Trainer(device(), small_capture().dataset, all_frames(small_capture().dataset),
                             shaken_start(small_capture(), 0.02, 11, 0), options),
                     InputError);
    };
    refused([](TrainOptions& o) { o.render.integrator = Integrator::march; });
    refused([](TrainOptions& o) { o.refine_poses = true; });
    refused([](TrainOptions& o) { o.sky = true; });
    refused([](TrainOptions& o) { o.batch = 2; });
    refused([](TrainOptions& o) { o.bands = 2; });
    refused([](TrainOptions& o) { o.final_splats = 20; });
    refused([](TrainOptions& o) {
        o.strategy = Strategy::adc;
        o.absolute_gradients = true;
    });
    Synthetic parallel;
    put_lens(parallel, {.lens = Lens::orthographic});
    TrainOptions options = quick(6);
    options.render.integrator = Integrator::ray;
    EXPECT_THROW(Trainer(device(), parallel.dataset, all_frames(parallel.dataset),
                         shaken_start(small_capture(), 0.02, 11, 0), options),
                 InputError);
}

}  // namespace
}  // namespace ewa::test
