// SPDX-License-Identifier: Apache-2.0
// The panel of a training run, and the trainer as a process of the viewer's own.
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "live/watcher.h"

namespace ewa::viewer {

/// Draws the panel. Returns what the user asked for in it: pause, resume or save.
std::optional<std::string> draw_training(const live::Update& run);

/// `ewa train` from beside this program, with `--serve 0`. It never waits for the window.
class TrainProcess {
  public:
    /// arguments: DATASET and whatever options of ewa train. Throws RunError where it cannot be started.
    TrainProcess(const std::vector<std::string>& arguments, const std::filesystem::path& output);
    /// Ends a training that still runs as Ctrl-C does: it saves its splats and a checkpoint first.
    ~TrainProcess();
    TrainProcess(const TrainProcess&) = delete;
    TrainProcess& operator=(const TrainProcess&) = delete;

    /// Its exit status once it has ended; 128 + the signal that ended it.
    std::optional<int> status();

  private:
    pid_t child_ = -1;
    std::optional<int> status_;
};

}  // namespace ewa::viewer
