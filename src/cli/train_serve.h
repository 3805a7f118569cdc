// SPDX-License-Identifier: Apache-2.0
// ewa train --serve: shows a training to those who watch it, and does what they ask for.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "ewa/trainer.h"
#include "live/server.h"

namespace ewa::cli {

class TrainServer {
  public:
    /// where: [ADDRESS:]PORT, or "" for no server. steps: of the whole training. folder/live.json holds the
    /// token while this lives. Throws InputError, RunError.
    TrainServer(const std::string& where, const std::filesystem::path& folder, int steps);
    ~TrainServer();

    /// One line for the terminal that says how to watch; empty without a server.
    std::string announcement() const;
    void add_metrics(const report::MetricsLine& line);
    /// Call after each step. Takes splats and saves where somebody asked for it. While somebody pauses the
    /// training, returns only at its end or at an interruption. save: writes splats and checkpoint.
    void attend(const Trainer& trainer, const StepReport& report, const std::function<void()>& save);
    /// Shows the last splats, and that the training is done.
    void finish(const StepReport& report, const Gaussians& gaussians);

  private:
    void report(const StepReport& report, live::State state);

    int steps_;
    std::filesystem::path folder_;
    std::string address_;
    std::unique_ptr<live::Server> server_;
};

}  // namespace ewa::cli
