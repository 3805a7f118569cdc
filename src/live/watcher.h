// SPDX-License-Identifier: Apache-2.0
// Follows a training run: over HTTP while its trainer serves, else by the files that the run writes.
#pragma once
#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "live/client.h"

namespace ewa::live {

/// In the folder of a run that is served: {"port", "token"}, readable by its owner alone.
inline constexpr const char* kLiveFile = "live.json";
struct LiveFile {
    uint16_t port = 0;
    std::string token;
};
/// Nothing where the folder has none that can be read.
std::optional<LiveFile> read_live_file(const std::filesystem::path& folder);
/// Throws RunError.
void write_live_file(const std::filesystem::path& folder, const LiveFile& live);

struct WhatToWatch {
    std::filesystem::path folder;    // of the run; may be empty
    std::optional<Address> address;  // of the trainer; without one, the folder's live file has it
    std::string token;
    // Files that have not changed since then are ignored.
    std::filesystem::file_time_type splats_after = std::filesystem::file_time_type::min();
    std::filesystem::file_time_type metrics_after = std::filesystem::file_time_type::min();
};

struct Update {
    Status status;                            // with all metrics
    std::shared_ptr<const Gaussians> splats;  // the newest; null where there are none yet
    int splats_step = -1;
    uint64_t number = 0;     // grows with every change
    bool connected = false;  // to the trainer, not only to its files
    std::string problem;     // why there is nothing new; one line, or empty
};

class Watcher {
  public:
    /// on_news: called on the watcher's thread after each change of update().
    Watcher(WhatToWatch what, std::function<void()> on_news);
    ~Watcher();

    Update update() const;
    uint64_t number() const;  // of the update
    /// pause, resume or save. update().problem says a refusal. A pause lasts while this watcher lives, and 10
    /// seconds longer.
    void command(const std::string& name);

  private:
    void work();
    void look();
    void look_by_connection();
    void look_at_files();
    void read_metrics();
    void change(const std::function<void(Update&)>& change);
    std::optional<std::string> next_command();

    const WhatToWatch what_;
    std::function<void()> on_news_;
    // Of the thread alone.
    std::unique_ptr<Client> client_;
    std::string run_, tag_;  // the run and the splats of the last update; empty: unknown
    std::filesystem::file_time_type splats_time_;
    std::uintmax_t metrics_read_ = 0;

    mutable std::mutex mutex_;
    std::condition_variable wake_;
    Update update_;
    std::vector<std::string> commands_;
    std::atomic<bool> stop_ = false;
    std::thread thread_;
};

}  // namespace ewa::live
