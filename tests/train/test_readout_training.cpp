// SPDX-License-Identifier: Apache-2.0
// Training on images of a rolling shutter.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "ewa/error.h"
#include "ewa/trainer.h"
#include "gpu/test_device.h"
#include "run/refined_cameras.h"
#include "scene/readout.h"
#include "support/random_scene.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

/// small_capture's views while each camera turns by 8 degrees.
void put_readouts(Synthetic& out) {
    out.truth = small_capture().truth;
    out.dataset = small_capture().dataset;
    Random random(92);
    for (Frame& frame : out.dataset.frames) {
        const glm::dvec3 way = glm::normalize(glm::dvec3(random.normal(), random.normal(), random.normal()));
        scene::add_readout(frame.camera, ReadoutFrom::top, 0.14 * way, glm::dvec3(0.2, 0.1, 0));
        draw_truth(out, frame);
    }
}

/// The mean loss of the last 16 steps.
double loss_after(const Dataset& dataset, const TrainOptions& options) {
    const auto frames = all_frames(dataset);
    Trainer trainer(device(), dataset, frames, shaken_start(small_capture(), 0.02, 11, 0), options);
    double sum = 0;
    int steps = 0;
    while (trainer.steps_done() < options.steps) {
        const StepReport report = trainer.step();
        if (trainer.steps_done() <= options.steps - 16) continue;
        sum += report.loss;
        ++steps;
    }
    return sum / steps;
}

TEST(ReadoutTraining, FitsWhatAGlobalShutterCannot) {
    Synthetic rolling;
    put_readouts(rolling);
    Dataset still = rolling.dataset;
    for (Frame& frame : still.frames)
        frame.camera = frame.pinhole = frame.source = scene::at_middle(frame.camera);
    TrainOptions options = quick(240);
    options.means_rate = 2e-3;
    options.means_rate_final = 2e-4;
    const double as_seen = loss_after(rolling.dataset, options), global = loss_after(still, options);
    options.batch = options.bands = 2;
    const double in_batches = loss_after(rolling.dataset, options);
    printf("    loss %.4f, in batches and bands of two %.4f; with a global shutter %.4f\n", as_seen,
           in_batches, global);
    EXPECT_LT(as_seen, 0.6 * global);
    EXPECT_LT(in_batches, 0.6 * global);
}

/// The dataset without what is known of the motion: cameras at rest in the middle of their readouts.
Dataset without_motion(Dataset dataset) {
    for (Frame& frame : dataset.frames) {
        const ReadoutFrom from = frame.camera.readout->from;
        frame.camera = scene::at_middle(frame.camera);
        frame.camera.readout = Readout{from, frame.camera.rotation, frame.camera.translation};
        frame.pinhole = frame.source = frame.camera;
    }
    return dataset;
}

/// By how much of the true motion across the readout the found one is wrong: the root mean square over the cameras.
struct MotionErrors {
    double turn = 0, shift = 0;
};
MotionErrors motion_errors(const std::vector<Camera>& found, const Dataset& truth,
                           const std::vector<int>& frames) {
    MotionErrors sum;
    for (size_t i = 0; i < frames.size(); ++i) {
        const auto is = scene::middle_motion(found[i]),
                   want = scene::middle_motion(truth.frames[size_t(frames[i])].camera);
        sum.turn +=
            std::pow(glm::length(is.turn - want.turn) / glm::length(want.turn), 2) / double(frames.size());
        sum.shift +=
            std::pow(glm::length(is.shift - want.shift) / glm::length(want.shift), 2) / double(frames.size());
    }
    return {std::sqrt(sum.turn), std::sqrt(sum.shift)};
}

TrainOptions learning(int steps) {
    TrainOptions options = quick(steps);
    options.means_rate = 2e-3;
    options.means_rate_final = 2e-4;
    options.refine_poses = true;
    return options;
}

/// Images alone tell little of a motion that all cameras share, since another scene looks alike. The loss tells that each camera's
/// own is found.
TEST(ReadoutTraining, LearnsTheMotion) {
    Synthetic rolling;
    put_readouts(rolling);
    const Dataset still = without_motion(rolling.dataset);
    const TrainOptions options = learning(400);
    TrainOptions without = options;
    without.refine_poses = false;
    const double learned = loss_after(still, options), global = loss_after(still, without);
    printf("    loss %.4f, without learning %.4f\n", learned, global);
    EXPECT_LT(learned, 0.6 * global);
}

/// Where the splats are known, so are the motions.
TEST(ReadoutTraining, AlignmentFindsTheMotionToo) {
    Synthetic rolling;
    put_readouts(rolling);
    const Dataset still = without_motion(rolling.dataset);
    const std::vector<int> frames{1, 4};
    const auto motions = train::align_cameras(device(), rolling.truth, still, frames, learning(100),
                                              scene_extent(still, all_frames(still)), [] {});
    std::vector<Camera> found;
    for (size_t i = 0; i < frames.size(); ++i)
        found.push_back(moved(still.frames[size_t(frames[i])].camera, motions[i]));
    const MotionErrors errors = motion_errors(found, rolling.dataset, frames);
    printf("    turns wrong by %.3f, shifts by %.3f\n", errors.turn, errors.shift);
    EXPECT_LT(errors.turn, 0.03);
    EXPECT_LT(errors.shift, 0.05);
}

/// A part of the cameras has a readout. The rest of the run is that of an uninterrupted one.
TEST(ReadoutTraining, ContinuesFromACheckpoint) {
    Synthetic rolling;
    put_readouts(rolling);
    rolling.dataset.frames[2].camera.readout.reset();
    const auto frames = all_frames(rolling.dataset);
    const Gaussians start = shaken_start(small_capture(), 0.02, 11, 0);
    const TrainOptions options = learning(40);
    Trainer whole(device(), rolling.dataset, frames, start, options);
    TrainerState state;
    while (whole.steps_done() < options.steps) {
        whole.step();
        if (whole.steps_done() == 20) state = whole.state();
    }
    Trainer later(device(), rolling.dataset, frames, start, options);
    later.restore(state);
    while (later.steps_done() < options.steps) later.step();
    EXPECT_EQ(later.camera_motions(), whole.camera_motions());
    EXPECT_EQ(later.gaussians().means, whole.gaussians().means);
    EXPECT_NE(whole.camera_motions()[1].readout_turn, glm::dvec3(0));
    EXPECT_EQ(whole.camera_motions()[2].readout_turn, glm::dvec3(0));
    EXPECT_NE(whole.camera_motions()[2].rotation, glm::dvec3(0));
}

TEST(ReadoutTraining, OthersAreRefused) {
    Synthetic rolling;
    put_readouts(rolling);
    const Gaussians start = shaken_start(small_capture(), 0.02, 11, 0);
    TrainOptions options = quick(6);
    options.sky = true;
    EXPECT_THROW(Trainer(device(), rolling.dataset, {0, 1}, start, options), InputError);
    options.sky = false;
    options.refine_poses = options.refine_focal = true;
    EXPECT_THROW(Trainer(device(), rolling.dataset, {0, 1}, start, options), InputError);
    // At rest, but it would learn to move.
    options.refine_focal = false;
    Dataset around = without_motion(rolling.dataset);
    around.frames[0].camera.distortion.lens = Lens::equirectangular;
    EXPECT_THROW(Trainer(device(), around, {0, 1}, start, options), InputError);
}

}  // namespace
}  // namespace ewa::test
