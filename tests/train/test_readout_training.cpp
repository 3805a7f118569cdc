// SPDX-License-Identifier: Apache-2.0
// Training on images of a rolling shutter.
#include <gtest/gtest.h>

#include <cmath>

#include "ewa/error.h"
#include "ewa/trainer.h"
#include "gpu/test_device.h"
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

TEST(ReadoutTraining, OthersAreRefused) {
    Synthetic rolling;
    put_readouts(rolling);
    const Gaussians start = shaken_start(small_capture(), 0.02, 11, 0);
    TrainOptions options = quick(6);
    options.refine_poses = true;
    EXPECT_THROW(Trainer(device(), rolling.dataset, {0, 1}, start, options), InputError);
    options.refine_poses = false;
    options.sky = true;
    EXPECT_THROW(Trainer(device(), rolling.dataset, {0, 1}, start, options), InputError);
}

}  // namespace
}  // namespace ewa::test
