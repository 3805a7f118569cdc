// SPDX-License-Identifier: Apache-2.0
// A head start for the compiler: the kernels of a run's first step, before its images and splats are known.
#pragma once
#include "gpu/device.h"
#include "run/run_input.h"

namespace ewa::train {

/// A guess of the first step. Kernels that it lacks are compiled with the step itself.
struct FirstStep {
    TrainOptions options;  // resolved
    Camera camera;
    size_t photos = 0, splats = 0;
};

/// Whether a run begins with the step that compile_kernels knows: one whole view, and one portion of new splats.
bool has_plain_step(const RunOptions& options);

/// input: as load_run has it before images are decoded.
FirstStep first_step(const RunInput& input);

/// Begins to compile the kernels of the step, and does not wait for them. It reports no errors.
void compile_kernels(gpu::Device& device, const FirstStep& step);

}  // namespace ewa::train
