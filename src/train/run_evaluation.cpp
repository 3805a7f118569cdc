// SPDX-License-Identifier: Apache-2.0
#include "train/run_evaluation.h"

#include <algorithm>
#include <cmath>

#include "core/folders.h"
#include "report/pictures.h"

namespace ewa::train {
namespace {

// Their mean says enough. All views of a large set would take longer than its training.
constexpr size_t kTrainViewsEvaluated = 40;
constexpr size_t kReportImages = 4;

Evaluation evaluate_frames(const RunOutcome& outcome, const std::vector<int>& frames,
                           const std::vector<Exposure>& exposures) {
    return evaluate(outcome.device, outcome.gaussians, outcome.input.dataset, frames,
                    outcome.input.options.train.render, exposures, outcome.before_frame);
}

}  // namespace

Evaluation evaluate_test(const RunOutcome& outcome) {
    return evaluate_frames(outcome, outcome.input.split.test, {});
}

double train_psnr(const RunOutcome& outcome, const std::vector<Exposure>& exposures) {
    const std::vector<int>& all = outcome.input.split.train;
    const std::vector<int> frames = spread_out(all, kTrainViewsEvaluated);
    std::vector<Exposure> used;
    for (size_t i = 0; i < all.size() && !exposures.empty(); ++i)
        if (std::find(frames.begin(), frames.end(), all[i]) != frames.end()) used.push_back(exposures[i]);
    return evaluate_frames(outcome, frames, used).psnr;
}

std::vector<int> report_frames(const Split& split) {
    return spread_out(split.test.empty() ? split.train : split.test, kReportImages);
}

std::vector<report::ReportPicture> render_report_images(const RunOutcome& outcome,
                                                        const std::vector<int>& frames,
                                                        const std::filesystem::path& folder) {
    const std::vector<Frame>& all = outcome.input.dataset.frames;
    const RenderOptions& options = outcome.input.options.train.render;
    const auto names = report::picture_names(all);
    Renderer renderer(outcome.device, outcome.gaussians, options);
    std::vector<report::ReportPicture> images;
    for (const int index : frames) {
        outcome.before_frame();
        const Frame& frame = all[size_t(index)];
        report::ReportPicture image;
        image.name = frame.name;
        TrainingImage target = load_training_image(frame, options.background);
        image.original = std::move(target.picture);
        image.rendering = renderer.render(frame.camera).color;
        image.psnr = psnr(image.rendering, image.original, target.weights);
        if (std::isnan(image.psnr)) continue;  // no pixel counts
        image.ssim = ssim(image.rendering, image.original, target.weights);
        const std::filesystem::path file = folder / (names[size_t(index)].string() + ".png");
        core::make_folder(file.parent_path());
        save_image(file, image.rendering);
        images.push_back(std::move(image));
    }
    return images;
}

}  // namespace ewa::train
