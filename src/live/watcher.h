// SPDX-License-Identifier: Apache-2.0
// A training run as it goes: by its connection where there is one, else by the files that it writes.
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

/// Where the trainer says how to reach it while it runs: {"port", "token"}, readable by its owner alone.
inline constexpr const char* kLiveFile = "live.json";
struct LiveFile {
    uint16_t port = 0;
    std::string token;
};
/// Nothing where there is none that can be read.
std::optional<LiveFile> read_live_file(const std::filesystem::path& folder);
/// Throws RunError.
void write_live_file(const std::filesystem::path& folder, const LiveFile& live);

struct WhatToWatch {
    std::filesystem::path folder;    // of the run; may be empty
    std::optional<Address> address;  // of the trainer; otherwise as the folder's live file has it
    std::string token;
    // Files that have not changed since are not news.
    std::filesystem::file_time_type splats_after = std::filesystem::file_time_type::min();
    std::filesystem::file_time_type metrics_after = std::filesystem::file_time_type::min();
};

struct Update {
    Status status;                            // its metrics: all there are
    std::shared_ptr<const Gaussians> splats;  // the last ones; null where there are none yet
    int splats_step = -1;
    uint64_t number = 0;     // grows with every change
    bool connected = false;  // to the trainer itself
    std::string problem;     // why nothing new comes; one line
};

class Watcher {
  public:
    /// on_news is called on the watcher's thread where update() has changed.
    Watcher(WhatToWatch what, std::function<void()> on_news);
    ~Watcher();

    Update update() const;
    uint64_t number() const;  // of the update
    /// pause, go or save; where it is refused, update() says so.
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
    // Touched by the thread alone.
    std::unique_ptr<Client> client_;
    bool fresh_ = false;  // the client has not been asked yet
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
