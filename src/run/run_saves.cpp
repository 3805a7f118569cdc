// SPDX-License-Identifier: Apache-2.0
#include "run/run_saves.h"

#include <algorithm>

#include "core/atomic_file.h"
#include "report/summary.h"
#include "run/disk_room.h"
#include "train/checkpoint.h"

namespace ewa::train {

using Json = nlohmann::ordered_json;

double RunProgress::wall_seconds() const {
    return seconds_before + std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

void RunProgress::take_later(const MetricsLine& line, double checkpoint_seconds) {
    if (!metrics.empty() && metrics.back().step >= line.step) return;
    metrics.push_back(line);
    seconds_before += std::max(0.0, line.wall_seconds - checkpoint_seconds);  // 0 where the line has no time
}

void RunSaves::continue_from(const TimesAt& checkpoint) {
    add_checkpoint(times_, checkpoint);
    checkpoint_step_ = checkpoint.step;
}

void RunSaves::checkpoint(const Trainer& trainer) {
    const auto start = std::chrono::steady_clock::now();
    const StepReport& last = progress_.last;
    times_.metrics = times_of(progress_.metrics);
    add_checkpoint(times_, {last.step, last.seconds, progress_.wall_seconds()});
    write_times(folder_.times(), times_);
    CheckpointWriter writer(folder_.checkpoint(),
                            settings_.dump(-1, ' ', false, Json::error_handler_t::replace),
                            report::metrics_text(without_times(progress_.metrics)));
    trainer.save(writer);
    writer.commit();
    checkpoint_step_ = last.step;
    pace_.saved(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

void RunSaves::checkpoint_if_due(const Trainer& trainer) {
    if (pace_.due()) checkpoint(trainer);
}

void RunSaves::last_checkpoint(const Trainer& trainer) {
    try {
        checkpoint(trainer);
    } catch (const core::FullDisk&) {
        what_fits(trainer);
        throw;
    }
}

void RunSaves::splats(const Gaussians& gaussians) {
    folder_.save_splats(gaussians, progress_.last.step, options_.train.render);
    splats_step_ = progress_.last.step;
}

void RunSaves::kept_splats(const Gaussians& gaussians) const {
    if (options_.keep > 0)
        folder_.keep_splats(gaussians, progress_.last.step, options_.train.render, options_.keep);
}

void RunSaves::result(const Trainer& trainer, bool kept) {
    const Gaussians gaussians = trainer.gaussians();
    splats(gaussians);
    if (kept) kept_splats(gaussians);
    folder_.save_sky(trainer.sky());
    if (!cameras_.refine()) return;
    cameras_.use_refined(trainer);
    cameras_.save(folder_, false);
    cameras_.use_given();
}

void RunSaves::what_fits(const Trainer& trainer) {
    // Other ranks may be in the middle of a step or of a checkpoint.
    if (options_.ranks->size() > 1 || checkpoint_step_ == progress_.last.step) return;
    try {
        checkpoint(trainer);
    } catch (const core::FullDisk&) {
        try {
            if (splats_step_ != progress_.last.step) splats(trainer.gaussians());
        } catch (const core::FullDisk&) {
            // The error that the user sees says what is left.
        }
    }
}

std::string RunSaves::after_full_disk() const {
    return train::after_full_disk(progress_.last.step, checkpoint_step_, splats_step_);
}

}  // namespace ewa::train
