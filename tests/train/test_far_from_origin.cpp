// SPDX-License-Identifier: Apache-2.0
// A georeferenced capture: the same scene 5,000 km from the origin, where float32 has a step of half a metre.
#include <gtest/gtest.h>

#include <cmath>

#include "ewa/evaluation.h"
#include "ewa/splat_edit.h"
#include "ewa/splat_files.h"
#include "ewa/trainer.h"
#include "gpu/test_device.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

const glm::dvec3 kPlace(5e6, 4e6, 300);

Dataset moved(Dataset dataset, const glm::dvec3& by) {
    for (Frame& frame : dataset.frames) frame.camera.translation -= frame.camera.rotation * by;
    for (glm::dvec3& p : dataset.points.positions) p += by;
    return dataset;
}

struct Trained {
    Gaussians gaussians;
    double psnr = 0;
};

Trained train(const Dataset& dataset) {
    const std::vector<int> frames = all_frames(dataset);
    TrainOptions options;
    options.steps = 200;
    options.sh_degree = 1;
    options.strategy = Strategy::none;
    options.short_run_power = 0;
    options.means_rate = 3e-3;
    options.sh0_rate = 0.05;
    options.scale_rate = 0.03;
    Trainer trainer(device(), dataset, frames, gaussians_from_points(dataset.points, 1), options);
    while (trainer.steps_done() < options.steps) trainer.step();
    Trained result{trainer.gaussians(), 0};
    result.psnr = evaluate(device(), result.gaussians, dataset, frames, options.render).psnr;
    return result;
}

TEST(FarFromTheOrigin, TrainsAsWellAsInTheMiddleAndComesOutWhereItWas) {
    const Dataset far = moved(small_capture().dataset, kPlace);
    const Trained here = train(small_capture().dataset), there = train(far);
    EXPECT_EQ(here.gaussians.origin, glm::dvec3(0));
    EXPECT_NE(there.gaussians.origin, glm::dvec3(0));
    EXPECT_GT(here.psnr, 20);
    EXPECT_NEAR(there.psnr, here.psnr, 0.1);

    const TempFolder folder;
    save_splats(folder / "far.ply", there.gaussians);
    const Gaussians back = load_splats(folder / "far.ply");
    double worst = 0, farthest = 0;
    for (size_t i = 0; i < back.size(); ++i) {
        worst = std::max(worst, glm::length(back.world_mean(i) - there.gaussians.world_mean(i)));
        farthest = std::max(farthest, glm::length(back.world_mean(i) - kPlace));
    }
    EXPECT_LT(worst, 1e-6);
    EXPECT_LT(farthest, 10);  // in the capture's own coordinates
    const std::vector<int> frames = all_frames(far);
    EXPECT_NEAR(evaluate(device(), back, far, frames, {}).psnr, there.psnr, 0.01);
}

TEST(FarFromTheOrigin, ACheckpointGoesOnWhereItWas) {
    const Dataset far = moved(small_capture().dataset, kPlace);
    const std::vector<int> frames = all_frames(far);
    TrainOptions options;
    options.steps = 20;
    options.strategy = Strategy::none;
    const Gaussians start = gaussians_from_points(far.points, 0);
    Trainer whole(device(), far, frames, start, options), first(device(), far, frames, start, options),
        second(device(), far, frames, start, options);
    for (int step = 0; step < 20; ++step) whole.step();
    for (int step = 0; step < 10; ++step) first.step();
    second.restore(first.state());
    for (int step = 0; step < 10; ++step) second.step();
    EXPECT_EQ(whole.gaussians().means, second.gaussians().means);
    EXPECT_EQ(whole.gaussians().origin, second.gaussians().origin);
    Trainer here(device(), small_capture().dataset, frames,
                 gaussians_from_points(small_capture().dataset.points, 0), options);
    EXPECT_THROW(here.restore(first.state()), std::exception);
}

TEST(FarFromTheOrigin, MovingASceneBackLeavesNoOrigin) {
    Gaussians g = gaussians_from_points(moved(small_capture().dataset, kPlace).points, 0);
    ASSERT_NE(g.origin, glm::dvec3(0));
    glm::dmat4 back(1.0);
    back[3] = glm::dvec4(-kPlace, 1);
    transform_splats(g, back);
    EXPECT_EQ(g.origin, glm::dvec3(0));
    const Gaussians here = gaussians_from_points(small_capture().dataset.points, 0);
    for (size_t i = 0; i < g.size(); ++i) EXPECT_LT(glm::length(g.world_mean(i) - here.world_mean(i)), 1e-6);
}

TEST(FarFromTheOrigin, JoiningScenesKeepsBothInPlace) {
    Gaussians joined = gaussians_from_points(moved(small_capture().dataset, kPlace).points, 0);
    const Gaussians other =
        gaussians_from_points(moved(small_capture().dataset, kPlace + glm::dvec3(100, 0, 0)).points, 0);
    const size_t n = joined.size();
    append_splats(joined, other);
    for (size_t i = 0; i < n; ++i)
        EXPECT_LT(glm::length(joined.world_mean(n + i) - other.world_mean(i)), 1e-4);
}

/// Formats that cannot store positions as doubles say what they cost.
TEST(FarFromTheOrigin, AnotherFormatSaysWhatItRounds) {
    const Gaussians g = gaussians_from_points(moved(small_capture().dataset, kPlace).points, 0);
    const TempFolder folder;
    const auto remarks = save_splats(folder / "far.splat", g, SaveOptions{});
    bool said = false;
    for (const std::string& remark : remarks)
        said = said || remark.find("rounded to 0.5 units") != std::string::npos;
    EXPECT_TRUE(said);
}

}  // namespace
}  // namespace ewa::test
