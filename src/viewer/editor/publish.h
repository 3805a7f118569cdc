// SPDX-License-Identifier: Apache-2.0
// Publishes a scene with its edits: a process of `ewa convert`, the program in this program's folder.
#pragma once
#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/process.h"
#include "ewa/gaussians.h"
#include "viewer/latest.h"

namespace ewa::viewer {

/// Runs `ewa` to its end. hear: gets what it says, as core::run_program gives it. Throws RunError if it cannot be started.
core::Ended run_ewa(const std::filesystem::path& program, std::vector<std::string> arguments,
                    const std::function<bool(std::string_view)>& hear);

/// What is published, and where to.
struct PublishOrder {
    std::filesystem::path scene;                         // empty: `splats`
    std::filesystem::path edits;                         // the journal of the scene; empty: none
    std::filesystem::path out;                           // its name gives the format
    std::filesystem::path views;                         // views that a page offers; empty: none
    std::string title;                                   // of a page; empty: the name of the file
    int levels = 0;                                      // of streamed levels; 0: as many as the scene needs
    std::shared_ptr<const Gaussians> splats;             // null: the scene is in a file
    std::shared_ptr<const std::vector<uint8_t>> states;  // of the splats, edit::State; null: all are left
};

/// The arguments of `ewa` for the order, whose scene is a file.
std::vector<std::string> publish_arguments(const PublishOrder& order);

/// The share of the work in a line such as "written 300/1000 splats, 12 s left"; empty for other lines.
std::optional<float> share_of_line(std::string_view line);

/// Opens the file or folder with the program of the desktop, which outlives this one.
void open_outside(const std::filesystem::path& path);

class Publisher {
  public:
    /// program: the file of `ewa`. wake: called on a thread of its own when progress() has changed, and at the end.
    Publisher(std::filesystem::path program, std::function<void()> wake);
    ~Publisher() { stop(); }
    Publisher(const Publisher&) = delete;
    Publisher& operator=(const Publisher&) = delete;

    /// Starts the work, unless some runs. A scene without a file is written to a temporary one first.
    void start(PublishOrder order);
    void stop() { stop_ = true; }
    bool running() const { return result_.running(); }

    struct Progress {
        std::string text;  // the last line of the program
        float share = 0;
        double seconds = 0;
    };
    Progress progress() const;

    struct Result {
        bool done = false, stopped = false;  // neither: it has failed, and the text says why
        std::string text;                    // the lines of the program
    };
    /// The result, once the work has ended.
    std::optional<Result> take();

  private:
    using Clock = std::chrono::steady_clock;
    Result run(PublishOrder order);
    bool hear(std::string_view piece);

    std::filesystem::path program_;
    std::function<void()> wake_;
    std::atomic<bool> stop_ = false;
    mutable std::mutex mutex_;
    std::string text_;  // of the program, under the mutex
    Clock::time_point started_{}, woken_{};
    Task<Result> result_;  // its thread ends before the rest
};

}  // namespace ewa::viewer
