// SPDX-License-Identifier: Apache-2.0
// How good the result of a run is: its figures, and the images of its report.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ewa/run.h"
#include "report/html.h"
#include "train/run_input.h"

namespace ewa::train {

/// The result of a run, and the dataset to compare it with.
struct RunOutcome {
    std::shared_ptr<gpu::Device> device;
    const RunInput& input;
    const Gaussians& gaussians;
    std::function<void()> before_frame;  // an exception from it ends the work
};

/// Of the test views.
Evaluation evaluate_test(const RunOutcome& outcome);

/// PSNR in dB of at most 40 training views, evenly spread. exposures: learned, one for each training frame; or
/// empty.
double train_psnr(const RunOutcome& outcome, const std::vector<Exposure>& exposures);

/// The frames that the report shows: at most four test views, or training views without a test set.
std::vector<int> report_frames(const Split& split);

/// Renders the frames and saves each as folder/<name>.png. Returns them with their training images. Throws
/// RunError, InputError.
std::vector<report::ReportPicture> render_report_images(const RunOutcome& outcome,
                                                        const std::vector<int>& frames,
                                                        const std::filesystem::path& folder);

}  // namespace ewa::train
