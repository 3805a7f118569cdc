// SPDX-License-Identifier: Apache-2.0
// The methods of drawing splats: which one options ask for, and the errors that say what it lacks.
#include "scene/methods.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "ewa/error.h"
#include "ewa/renderer.h"
#include "pipeline/plan.h"
#include "scene/looks.h"
#include "train/schedule.h"

namespace ewa::test {
namespace {

const RenderOptions kSpheres{.points = true}, kByRay{.integrator = Integrator::ray},
    kByMarch{.integrator = Integrator::march};

std::string said_by(const std::function<void()>& what) {
    try {
        what();
    } catch (const InputError& error) {
        return error.what();
    }
    return {};
}

TEST(Methods, AreThoseThatTheOptionsAskFor) {
    for (const auto& [word, integrator] : scene::kIntegratorWords) {
        const scene::Method& method = scene::method_of({.integrator = integrator});
        const bool usual = integrator == Integrator::splat;
        EXPECT_EQ(method.full, usual ? "" : "--integrator " + std::string(word));
        EXPECT_EQ(method.rays, !usual);
        EXPECT_EQ(&method, &scene::method_of(method.kind));
        EXPECT_EQ(
            said_by([i = integrator] { scene::method_of({.integrator = i, .points = true}); }),
            usual ? "" : "--points and --integrator exclude each other: spheres are blended on the image");
    }
    EXPECT_EQ(scene::method_of(kSpheres).option, "--points");
    EXPECT_EQ(scene::method_of(kSpheres).kind, scene::MethodKind::points);
}

TEST(Methods, OfRendersSayWhatTheyLack) {
    const auto look = [](RenderOptions render, Footprint kernel) {
        render.kernel = kernel;
        return said_by([&] { scene::check_look({.render = render}); });
    };
    EXPECT_EQ(look(kSpheres, Footprint::density),
              "--points and --kernel density exclude each other: a sphere has no footprint");
    EXPECT_EQ(look(kByMarch, Footprint::antialias),
              "--integrator march and --kernel antialias exclude each other: the others antialias");
    EXPECT_EQ(look(kByMarch, Footprint::density) + look(kByRay, Footprint::antialias), "");
    EXPECT_EQ(said_by([] { scene::check_look({.render = kByRay, .nearest = true}); }),
              "--nearest is an option of --points");
    EXPECT_EQ(said_by([] { scene::check_look({.render = kByRay, .samples = true}); }),
              "--samples is an option of --integrator march");

    const auto lens = [](const RenderOptions& render, Lens model, bool moves = false) {
        Camera camera{.width = 8, .height = 8};
        camera.distortion.lens = model;
        if (moves) camera.readout = Readout{.translation = {1, 0, 0}};
        return said_by([&] { scene::check_lens(render, camera); });
    };
    EXPECT_EQ(lens(kSpheres, Lens::fisheye),
              "--points draws through pinholes only; take --lens undistort for images of another lens");
    EXPECT_EQ(lens(kSpheres, Lens::orthographic), lens(kSpheres, Lens::fisheye));
    EXPECT_EQ(lens(kByRay, Lens::orthographic),
              "--integrator splat alone draws parallel rays; the others need a lens with a centre");
    EXPECT_EQ(lens(kByMarch, Lens::brown, true), "--integrator draws no images of a rolling shutter");
    EXPECT_EQ(lens(kByRay, Lens::fisheye) + lens({}, Lens::fisheye, true), "");
}

TEST(Methods, OfPlansSayWhatTheyLack) {
    using pipeline::PlanRequest, pipeline::Purpose;
    const auto plan = [](const PlanRequest& request) {
        return said_by([&] { pipeline::plan_for(request); });
    };
    EXPECT_EQ(plan({.purpose = Purpose::training, .render = kByMarch}),
              "the integrator march cannot train; the others do");
    EXPECT_EQ(plan({.render = kByMarch, .drawing = Drawing::depth}),
              "the integrator march draws no depth; the others do");
    EXPECT_EQ(plan({.render = kByRay, .drawing = Drawing::count}),
              "the integrator ray draws neither counts nor ellipsoids; splat does");
    EXPECT_EQ(plan({.render = kByRay, .debug = true, .splat_scale = 2}),
              "the integrator ray draws splats at their own scale; splat draws others");
    EXPECT_EQ(plan({.render = kByRay, .drawing = Drawing::normal}),
              "only the integrator splat draws normals");
    EXPECT_EQ(plan({.render = kSpheres, .drawing = Drawing::median_depth}),
              "--points draws no surface, so the median depth cannot be drawn");
    EXPECT_EQ(plan({.render = kByRay, .marks = kMarkHidden}),
              "the integrator ray cannot hide or tint marked splats");
    EXPECT_EQ(plan({.render = kByRay, .marks = 128}), "");
    EXPECT_EQ(plan({.render = kSpheres, .drawing = Drawing::count}), "");
    EXPECT_EQ(plan({.purpose = Purpose::training, .render = kByRay}), "");
}

TEST(Methods, OfTrainingsSayWhatTheyLack) {
    const auto training = [](const RenderOptions& render, const std::function<void(TrainOptions&)>& change) {
        TrainOptions options;
        options.strategy = Strategy::none;
        options.render = render;
        change(options);
        return said_by([&] { train::check_training(options, 1); });
    };
    const std::string points = "--points and ", rays = "--integrator and ", each = " exclude each other: ";
    const auto mcmc = [](TrainOptions& o) { o.strategy = Strategy::mcmc; };
    EXPECT_EQ(training(kSpheres, mcmc),
              points + "--strategy mcmc" + each + "it moves splats of low opacity, and a sphere has none");
    const auto final_splats = [](TrainOptions& o) { o.final_splats = 9; };
    EXPECT_EQ(training(kSpheres, final_splats),
              points + "--final-splats" + each + "a sphere has no weight at a pixel");
    EXPECT_EQ(training(kByRay, final_splats),
              rays + "--final-splats" + each + "rays count no weights at a pixel");
    const auto poses = [](TrainOptions& o) { o.refine_poses = true; };
    EXPECT_EQ(training(kSpheres, poses),
              points + "--refine-poses" + each + "spheres have no gradient by the camera");
    EXPECT_EQ(training(kByRay, poses),
              rays + "--refine-poses" + each + "rays have no gradient by the camera");
    EXPECT_EQ(training(kSpheres, [](TrainOptions& o) { o.loss.depth = 1; }),
              "--loss depth and --points" + each + "the depth of a sphere has no gradient");
    EXPECT_EQ(training(kByRay, [](TrainOptions& o) { o.loss.sfm_depth = 1; }),
              "--loss sfm-depth and --integrator" + each + "depths along rays have no gradient");
    EXPECT_EQ(training(kByRay, [](TrainOptions& o) { o.sky = true; }),
              rays + "--background sky" + each + "rays have no gradient by the transmittance");
    EXPECT_EQ(training(kByRay, [](TrainOptions& o) { o.absolute_gradients = true; }),
              rays + "--absgrad" + each + "rays have no gradient of single pixels");
    EXPECT_EQ(training(kSpheres, [](TrainOptions& o) { o.sky = o.absolute_gradients = true; }), "");
    EXPECT_EQ(training(kByRay, mcmc), "");
}

}  // namespace
}  // namespace ewa::test
