// SPDX-License-Identifier: Apache-2.0
#include "cli/train_observer.h"

#include <spdlog/fmt/fmt.h>

#include "core/messages.h"
#include "core/text.h"

namespace ewa::cli {

void TrainObserver::on_note(const std::string& line) {
    if (progress_)
        progress_->note(line);
    else if (!output_.quiet)
        fmt::print("{}\n", core::one_line(line));
}

void TrainObserver::on_start(const RunStart& start) {
    on_note(fmt::format("{}: {} views to train on, {} held out, {}x{}; {} splats to start from", start.name,
                        start.train_views, start.test_views, start.width, start.height, start.splats));
    for (const std::string& remark : start.remarks) on_note(remark);
    on_note("device: " + start.device.name);
    const MemoryEstimate& memory = start.memory;
    on_note(fmt::format("memory: up to {} for {} splats ({} model, {} frame, {} training images)",
                        core::bytes_text(memory.total()), memory.splats, core::bytes_text(memory.model),
                        core::bytes_text(memory.frame), core::bytes_text(memory.images)));
    if (memory.total() > start.device.memory_bytes)
        on_note(
            fmt::format("the device has {}: if memory runs out, a smaller --max-splats or --image-cache, or "
                        "a larger --downscale, takes less",
                        core::bytes_text(start.device.memory_bytes)));
    watch_.emplace();
}

void TrainObserver::on_plan(const std::vector<PlanLine>& plan) {
    if (!output_.verbose) return;
    for (const PlanLine& line : plan)
        on_note(fmt::format("left out: {} ({}{})", line.what, line.why,
                            line.bytes_saved > 0 ? ", saves " + core::bytes_text(line.bytes_saved) : ""));
}

void TrainObserver::on_begin(const std::filesystem::path& folder, const std::vector<MetricsLine>& metrics) {
    server_.emplace(output_.serve, folder, steps_);
    for (const MetricsLine& line : metrics) server_->add_metrics(line);
    if (const std::string line = server_->announcement(); !line.empty()) on_note(line);
    progress_.emplace("trained", steps_, "steps", output_.quiet);
}

void TrainObserver::on_step(const StepReport& step) {
    if (progress_->due(step.step))
        progress_->update(step.step, fmt::format("loss {:.4f}, {} splats", step.loss, step.splats));
}

void TrainObserver::on_evaluation(int step, const Evaluation& evaluation) {
    on_note(
        fmt::format("step {}: held-out PSNR {:.2f} dB, SSIM {:.4f}", step, evaluation.psnr, evaluation.ssim));
}

void TrainObserver::on_metrics(const MetricsLine& line) {
    server_->add_metrics(line);
}

void TrainObserver::between_steps(const StepReport& step, const Trainer& trainer,
                                  const std::function<void()>& save) {
    server_->attend(trainer, step, save);
}

void TrainObserver::on_saved(const StepReport&) {
    progress_.reset();
}

void TrainObserver::on_evaluated(const StepReport& step, const Gaussians& gaussians) {
    server_->finish(step, gaussians);
}

void TrainObserver::print(const RunResult& result) {
    const Summary& s = result.summary;
    on_note(fmt::format("{} {} steps in {} of training ({} in all), {} splats",
                        s.interrupted ? "interrupted after" : "trained", s.steps,
                        core::duration_text(s.seconds), core::duration_text(s.wall_seconds), s.splats));
    if (s.test_psnr) on_note(fmt::format("held-out PSNR {:.2f} dB, SSIM {:.4f}", *s.test_psnr, *s.test_ssim));
    if (s.train_psnr) on_note(fmt::format("training PSNR {:.2f} dB", *s.train_psnr));
    if (s.skipped_nonfinite > 0)
        on_note(
            fmt::format("{} splats have a value that is not finite and are skipped", s.skipped_nonfinite));
    if (s.dropped_updates > 0)
        on_note(fmt::format("{} updates were not finite and were dropped", s.dropped_updates));
    if (s.limited_steps > 0)
        on_note(fmt::format("{} updates were too long for their splat and were shortened", s.limited_steps));
    on_note("splats:  " + (result.folder / "splats.ply").string());
    on_note("report:  " + (result.folder / "report.html").string());
    if (!result.first_render.empty()) on_note("render:  " + result.first_render.string());
}

}  // namespace ewa::cli
