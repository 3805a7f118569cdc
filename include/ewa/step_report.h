// SPDX-License-Identifier: Apache-2.0
// Figures of the steps of a training, and its state after them.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "ewa/device.h"

namespace ewa {

/// Figures of a training after a step.
struct StepReport {
    int step = 0;        // steps done
    double seconds = 0;  // wall time in Trainer::step so far
    double loss = 0;     // of the last step that the device has finished; a GPU may be a step behind
    uint32_t splats = 0;
    uint64_t dropped_updates = 0;    // parameter updates so far that were not finite and were dropped
    uint32_t skipped_nonfinite = 0;  // splats skipped in the last step: a value is not finite
    uint64_t limited_steps = 0;      // updates of a mean, quaternion or scale so far that were shortened
    /// PSNR of the training image that `loss` belongs to, in dB. In a masked image, pixels count by the square of their weight. NaN
    /// if no pixel counts.
    double psnr = 0;
};

/// Mean times of a step in ms, over the steps since the trainer was made or restored.
struct StepTimes {
    int steps = 0;
    double step = 0;        // wall time in Trainer::step
    double refinement = 0;  // part of `step`: adding, moving and removing splats
    // Recording and submitting the commands, where a step is one submission; else 0. Steps that compile kernels do not count.
    double host = 0;
    int recorded = 0;  // steps with one submission whose commands were recorded; the others were replayed
    std::vector<PassTime> passes;  // on the device, in recording order. On a GPU they are of every 100th step
};

/// One device buffer of a TrainerState.
struct TrainerArray {
    std::string name;  // at most 15 bytes
    std::vector<std::byte> bytes;
};

/// The state that later steps depend on, besides dataset, training frames and options.
struct TrainerState {
    StepReport report;
    int sh_degree = 0;  // of the stored coefficients
    /// params, moments1, with 32 bits a moment also moments2, and the strategy's statistics, in the device's layout
    /// (shaders/shared/layouts.h).
    std::vector<TrainerArray> arrays;
};

}  // namespace ewa
