// SPDX-License-Identifier: Apache-2.0
// The observer of a training run, which may end it.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/device.h"
#include "ewa/evaluation.h"
#include "ewa/summary.h"
#include "ewa/trainer.h"

namespace ewa {

/// Facts of a run that are known before its training begins.
struct RunStart {
    std::string name;                  // run_name
    const Dataset* dataset = nullptr;  // exists for the length of the call
    size_t train_views = 0, test_views = 0;
    int width = 0, height = 0;         // of the first training image, px
    size_t splats = 0;                 // the initial ones
    TrainOptions train;                // automatic values are resolved, except max_splats
    uint32_t max_splats = 0;           // of the run
    size_t evaluated = 0;              // views that are rendered at the end
    std::vector<std::string> remarks;  // one line each, e.g. "3 images are missing and are skipped"
    DeviceInfo device;
    MemoryEstimate memory;
};

/// What an observer may ask of a run between two steps.
struct RunCommands {
    std::function<void()> save;  // writes splats.ply and checkpoint.ewa
    /// Trainer::edit. It is noted in metrics.jsonl and in the report, and the observer's StepReport has the new number of splats.
    std::function<EditCounts(const SplatEdit&)> edit;
};

/// Follows a run and may end it. All calls come from the thread that called run_training, in the order of
/// their declarations. An exception from any of them ends the run and reaches the caller of run_training.
class RunObserver {
  public:
    virtual ~RunObserver() = default;

    /// Asked before each step and each evaluated view. True ends the run: splats and checkpoint are saved, and
    /// a run with RunOptions::resume can continue it.
    virtual bool should_stop() { return false; }
    /// One line of text for the user.
    virtual void on_note(const std::string&) {}

    /// The dataset and the device are open. No device memory is allocated yet.
    virtual void on_start(const RunStart&) {}
    /// The work that the training skips because the scene does not need it.
    virtual void on_plan(const std::vector<PlanLine>&) {}
    /// Training begins. metrics: the lines of the run that this one continues.
    virtual void on_begin(const std::filesystem::path& /*folder*/,
                          const std::vector<MetricsLine>& /*metrics*/) {}
    /// An optimisation step is done.
    virtual void on_step(const StepReport&) {}
    /// The held-out views were evaluated after this step. The last step has on_evaluated instead.
    virtual void on_evaluation(int /*step*/, const Evaluation&) {}
    /// A line was added to metrics.jsonl.
    virtual void on_metrics(const MetricsLine&) {}
    /// All work after a step is done, and another step follows.
    virtual void between_steps(const StepReport&, const Trainer&, const RunCommands&) {}
    /// Training has ended. splats.ply and checkpoint.ewa are written.
    virtual void on_saved(const StepReport&) {}
    /// The final evaluation has evaluated `done` of `views` views.
    virtual void on_view(size_t /*done*/, size_t /*views*/) {}
    /// The final evaluation is done, unless the run was stopped. No more metrics follow.
    virtual void on_evaluated(const StepReport&, const Gaussians&) {}
};

}  // namespace ewa
