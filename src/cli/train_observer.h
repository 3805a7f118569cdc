// SPDX-License-Identifier: Apache-2.0
// A training run as `ewa train` shows it: lines on the terminal, signals, and a server for --serve.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/interrupt.h"
#include "cli/output.h"
#include "ewa/dataset.h"
#include "ewa/run.h"
#include "ewa/splat_scene.h"
#include "run/forecast.h"

namespace ewa::cli {

struct TrainOutput {
    bool quiet = false, verbose = false;
    std::string serve;  // [ADDRESS:]PORT; empty: no server
};

/// Throws InputError or RunError if --serve cannot listen at [ADDRESS:]PORT.
void check_serve(const std::string& where);

class TrainObserver : public RunObserver {
  public:
    /// steps: of the whole training. progress: of the work before it, such as finding cameras; may be null.
    TrainObserver(const TrainOutput& output, int steps, std::unique_ptr<Progress> progress = nullptr);
    ~TrainObserver() override;

    bool should_stop() override { return interrupted(); }
    void on_note(const std::string& line) override;
    void on_start(const RunStart& start) override;
    void on_plan(const std::vector<PlanLine>& plan) override;
    void on_begin(const std::filesystem::path& folder, const std::vector<MetricsLine>& metrics) override;
    void on_step(const StepReport& step) override;
    void on_evaluation(int step, const Evaluation& evaluation) override;
    void on_metrics(const MetricsLine& line) override;
    void between_steps(const StepReport& step, const Trainer& trainer, const RunCommands& commands) override;
    void on_saved(const StepReport& step) override;
    void on_view(size_t done, size_t views) override;
    void on_evaluated(const StepReport& step, const Gaussians& gaussians) override;

    void print(const RunResult& result);

  private:
    class Served;
    void forecast(const StepReport& step);

    TrainOutput output_;
    int steps_;
    std::optional<InterruptWatch> watch_;
    Dataset cameras_;  // those of the page that the server gives
    SaveOptions page_;
    std::unique_ptr<Served> served_;  // null without --serve
    std::string undrawable_;          // why splats are skipped
    std::unique_ptr<Progress> progress_;
    std::optional<train::Forecast> forecast_;
    int first_step_ = 0;         // of this process; 0 before it
    bool printed_time_ = false;  // how long the run takes
    // Training PSNR of the steps since the progress was last shown; steps differ much, since each has another view.
    double psnr_sum_ = 0;
    int psnr_steps_ = 0;
};

}  // namespace ewa::cli
