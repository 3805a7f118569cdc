// SPDX-License-Identifier: Apache-2.0
// ewa bench --accuracy: error against run time, of rendering and of training.
#pragma once
#include <filesystem>
#include <memory>

#include "ewa/camera.h"
#include "ewa/device.h"
#include "ewa/gaussians.h"
#include "ewa/render_options.h"
#include "report/chart.h"

namespace ewa::cli {

struct AccuracyArguments {
    std::filesystem::path dataset, splats;  // splats empty: the result of the training
    std::filesystem::path json, svg;        // empty: not written; NAME_training.svg is written beside svg
    int steps = 600;                        // of each training; 0: no training
    DeviceOptions device;
};

/// Error against run time of rendering a scene through one camera.
report::WorkPrecision rendering_diagram(const std::shared_ptr<gpu::Device>& device,
                                        const Gaussians& gaussians, const Camera& camera,
                                        const RenderOptions& options);

/// Prints tables and writes the files. Returns the exit status. Throws InputError, RunError.
int run_accuracy(const AccuracyArguments& arguments);

}  // namespace ewa::cli
