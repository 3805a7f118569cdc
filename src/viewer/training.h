// SPDX-License-Identifier: Apache-2.0
// A training run that the window watches, and the trainer that the viewer starts.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "live/watcher.h"
#include "platform/process.h"

namespace ewa::viewer {

/// A process of `ewa train --serve 0`. Its program is the `ewa` in this program's folder. It never waits for the window.
class TrainProcess {
  public:
    /// arguments: DATASET and options of ewa train. Throws RunError if it cannot be started.
    TrainProcess(const std::vector<std::string>& arguments, const std::filesystem::path& output);
    /// Interrupts a training that still runs, as Ctrl-C does: it saves splats and a checkpoint first.
    ~TrainProcess();
    TrainProcess(const TrainProcess&) = delete;
    TrainProcess& operator=(const TrainProcess&) = delete;

    /// Whether ewa train accepts these options. If not, ewa train has printed the reason. Throws RunError if it cannot be started.
    static bool accepts(const std::vector<std::string>& arguments, const std::filesystem::path& output);

    /// The exit status once the training has ended: 128 + the signal's number if a signal ended it. Empty before.
    std::optional<int> status();

  private:
    platform::Process child_;
    std::optional<int> status_;
};

/// The command line that makes a web page of the run in this folder. Empty if `folder` is.
std::string how_to_share(const std::filesystem::path& folder);

/// The training run that the window watches, if any.
class LiveRun {
  public:
    /// wake: called on the watcher's thread when take() has something new.
    explicit LiveRun(std::function<void()> wake) : wake_(std::move(wake)) {}

    /// trainer: the run's process if the viewer started it, or null. It must live until the next call of watch() or stop().
    void watch(const live::WhatToWatch& what, TrainProcess* trainer);
    void stop() {
        watcher_.reset();
        trainer_ = nullptr;
    }
    /// Whether the viewer started the run.
    bool own() const { return trainer_ != nullptr; }
    /// The status of the run, or null without one.
    const live::Update* update() const { return watcher_ ? &update_ : nullptr; }
    struct News {
        bool any = false;
        std::shared_ptr<const Gaussians> splats;  // new ones, at least one; or null
    };
    News take();
    const std::filesystem::path& folder() const { return folder_; }  // may be empty
    void command(const std::string& command);
    void edit(const std::string& body);  // as Watcher::edit
    /// The exit status of a trainer that failed before the run was done.
    std::optional<int> failure() const;

  private:
    TrainProcess* trainer_ = nullptr;
    std::filesystem::path folder_;
    std::function<void()> wake_;
    live::Update update_;
    std::unique_ptr<live::Watcher> watcher_;
};

}  // namespace ewa::viewer
