// SPDX-License-Identifier: Apache-2.0
// Files that a run saves while it trains: checkpoint, times, splats, refined cameras.
#pragma once
#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "ewa/trainer.h"
#include "run/resume.h"
#include "run/run_cameras.h"
#include "run/run_files.h"
#include "run/run_times.h"

namespace ewa::train {

/// How far a run has come.
struct RunProgress {
    std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::now();
    double seconds_before = 0;  // of the run that this one continues, and of the work before `begin`
    StepReport last;
    std::vector<MetricsLine> metrics;

    double wall_seconds() const;
    /// Takes a line that came after the checkpoint, and the time since then, unless the metrics have its step.
    void take_later(const MetricsLine& line, double checkpoint_seconds);
};

/// Saves the state of a trainer. All of its functions throw RunError.
class RunSaves {
  public:
    /// What is passed must outlive this.
    RunSaves(const RunWriter& folder, const RunOptions& options, RunCameras& cameras,
             const RunProgress& progress)
        : folder_(folder), options_(options), cameras_(cameras), progress_(progress) {}

    /// The settings that checkpoints hold.
    nlohmann::ordered_json& settings() { return settings_; }
    /// The run continues from the checkpoint of this step.
    void continue_from(const TimesAt& checkpoint);

    void checkpoint(const Trainer& trainer);
    /// A checkpoint, unless the clock says that it is too early.
    void checkpoint_if_due(const Trainer& trainer);
    /// Saves a checkpoint after the last step. If the disk is full, saves the smaller splats.ply before the error is thrown.
    void last_checkpoint(const Trainer& trainer);
    void splats(const Gaussians& gaussians);
    /// The splats as those of a step that --keep counts.
    void kept_splats(const Gaussians& gaussians) const;
    /// The splats, and the cameras that belong to them. kept: of a step that --keep counts.
    void result(const Trainer& trainer, bool kept);
    /// After a write that found the disk full: the checkpoint, or the smaller splats.
    void what_fits(const Trainer& trainer);
    /// How a run can be continued after its disk was full, for the end of an error.
    std::string after_full_disk() const;

  private:
    const RunWriter& folder_;
    const RunOptions& options_;
    RunCameras& cameras_;
    const RunProgress& progress_;
    nlohmann::ordered_json settings_;
    SavePace pace_;
    RunTimes times_;            // of the checkpoints
    int checkpoint_step_ = -1;  // of checkpoint.ewa; -1: there is none
    int splats_step_ = -1;      // of splats.ply, if this run wrote it
};

}  // namespace ewa::train
