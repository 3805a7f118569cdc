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
    double seconds_before = 0;  // wall time of the continued run, and of work before `begin`
    StepReport last;
    std::vector<MetricsLine> metrics;

    double wall_seconds() const;
    /// Adds a metrics line that was written after the checkpoint, and the time from checkpoint to line, unless `metrics` has its
    /// step.
    void take_later(const MetricsLine& line, double checkpoint_seconds);
};

/// Saves the state of a trainer. All of its functions throw RunError.
class RunSaves {
  public:
    /// The references must outlive this object.
    RunSaves(const RunWriter& folder, const RunOptions& options, RunCameras& cameras,
             const RunProgress& progress)
        : folder_(folder), options_(options), cameras_(cameras), progress_(progress) {}

    /// The settings that each checkpoint stores. The caller fills them.
    nlohmann::ordered_json& settings() { return settings_; }
    /// Notes that the run continues from this checkpoint.
    void continue_from(const TimesAt& checkpoint);

    void checkpoint(const Trainer& trainer);
    /// Saves a checkpoint if SavePace says that one is due.
    void checkpoint_if_due(const Trainer& trainer);
    /// Saves a checkpoint after the last step. If the disk is full, saves the smaller splats.ply before the error is thrown.
    void last_checkpoint(const Trainer& trainer);
    void splats(const Gaussians& gaussians);
    /// Saves the splats under the name of their step, for --keep.
    void kept_splats(const Gaussians& gaussians) const;
    /// Saves the splats and, if they are refined, the cameras. kept: saves the splats for --keep too.
    void result(const Trainer& trainer, bool kept);
    /// Call it after a write failed because the disk is full. Saves the checkpoint or, if that does not fit, the smaller
    /// splats.ply.
    void what_fits(const Trainer& trainer);
    /// The end of an error about a full disk: how the run can be continued.
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
