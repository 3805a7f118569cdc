// SPDX-License-Identifier: Apache-2.0
#include "run/run_log.h"

#include <spdlog/fmt/fmt.h>

#include <chrono>
#include <utility>

#include "core/typing.h"
#include "folders/run_folder.h"

namespace ewa::train {

RunLog::RunLog(const RunWriter& folder, bool tensorboard, RunProgress& progress)
    : progress_(progress), lines_(folder.metrics(), progress.metrics) {
    if (tensorboard)
        events_.emplace(
            folder.path() / folders::kEventsFile, progress.metrics,
            std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count() -
                progress.wall_seconds());
}

const MetricsLine& RunLog::add(const std::optional<Evaluation>& evaluation,
                               const std::optional<EditCounts>& edit) {
    const StepReport& last = progress_.last;
    MetricsLine line{last.step, last.seconds, progress_.wall_seconds(), last.loss, last.splats, {}, {}, {}};
    if (last.step > 0) line.train_psnr = last.psnr;
    if (evaluation && !evaluation->frames.empty()) {
        line.test_psnr = evaluation->psnr;
        line.test_ssim = evaluation->ssim;
        line.test_figures = evaluation->figures;
    }
    line.edit = edit;
    lines_.append(line);
    if (events_) events_->append(line);
    return progress_.metrics.emplace_back(std::move(line));
}

std::string edit_text(int step, const EditCounts& edit) {
    std::string done;
    const auto add = [&](const char* what, uint32_t splats) {
        if (splats > 0)
            done += fmt::format("{} {} {}", done.empty() ? "" : ",", what, core::counted(splats, "splat"));
    };
    add("removed", edit.removed);
    add("froze", edit.frozen);
    add("freed", edit.unfrozen);
    return fmt::format("step {}: an edit{}", step, done.empty() ? " changed no splat" : done);
}

std::vector<std::string> edit_texts(const std::vector<MetricsLine>& metrics) {
    std::vector<std::string> texts;
    for (const MetricsLine& line : metrics)
        if (line.edit) texts.push_back(edit_text(line.step, *line.edit));
    return texts;
}

}  // namespace ewa::train
