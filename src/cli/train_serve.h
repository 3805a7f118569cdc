// SPDX-License-Identifier: Apache-2.0
// ewa train --serve: what those who look on are given, and what they may ask for.
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
    /// where: [ADDRESS:]PORT, or "" for nobody. The token goes to folder/live.json, which is gone when this
    /// is. Throws InputError, RunError.
    TrainServer(const std::string& where, const std::filesystem::path& folder, int steps);
    ~TrainServer();

    /// One line for the terminal; empty where nobody can look on.
    std::string announcement() const;
    void add_metrics(const report::MetricsLine& line);
    /// After a step: gives what is asked for, and while the training is to pause comes back only when it is
    /// to go on or was interrupted. save: splats and checkpoint.
    void attend(const Trainer& trainer, const StepReport& report, const std::function<void()>& save);
    /// The last splats: nothing more will come.
    void finish(const StepReport& report, const Gaussians& gaussians);

  private:
    void report(const StepReport& report, live::State state);

    int steps_;
    std::filesystem::path folder_;
    std::string address_;
    std::unique_ptr<live::Server> server_;
};

}  // namespace ewa::cli
