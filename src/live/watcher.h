// SPDX-License-Identifier: Apache-2.0
// Follows a training run: over HTTP (server.h) while its trainer serves, else by the files that the run writes.
#pragma once
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "ewa/gaussians.h"
#include "live/status.h"

namespace ewa::live {

inline constexpr std::chrono::seconds kPatience(30);

struct Address {
    std::string host;
    uint16_t port = 0;
};
/// "host:port", "[v6]:port" or ":port" (this machine). Throws InputError.
Address parse_address(const std::string& text);

/// Splats of a run, and the server's tag for them.
struct TaggedSplats {
    int step = 0;
    std::string tag;
    Gaussians gaussians;
    std::vector<bool> frozen;  // of each splat; empty: none is
};

/// Each request has its own connection. Anybody may answer: sizes are limited, and only bytes that have come take
/// memory.
class Client {
  public:
    /// Does not connect yet. token: empty for watching without commands. stop: may be null. Once it is true,
    /// every wait ends at once with an error.
    /// patience: for an answer's header, then for each part of its body.
    Client(const Address& address, const std::string& token, const std::atomic<bool>* stop = nullptr,
           std::chrono::milliseconds patience = kPatience);
    ~Client();

    // Each throws InputError for a refusal, or an answer that is not a trainer's. Each throws RunError if nobody
    // answers or the connection ends.

    /// Requests the run's status, with the lines of metrics from `first_line` on.
    Status status(size_t first_line);
    /// Requests splats whose tag differs from `tag`. Returns nothing if the server has none. tag: empty for any splats.
    std::optional<TaggedSplats> splats(const std::string& tag);
    /// Sends a command to the trainer. name: pause, resume or save.
    void command(const std::string& name);
    /// Sends an edit of the splats, and waits until the trainer has done it. body: at most kMostEdit bytes (server.h).
    EditReply edit(const std::string& body);

  private:
    class Http;
    std::unique_ptr<Http> http_;
};

/// folders::kLiveFile of a run that is served: {"port", "token"}, readable only by its owner.
struct LiveFile {
    uint16_t port = 0;
    std::string token;
};
/// Reads the live file of a run's folder. Empty if there is none that can be read.
std::optional<LiveFile> read_live_file(const std::filesystem::path& folder);
/// The token that was given, else that of the file, which is a live file or the token alone, else that of the variable
/// EWA_TOKEN. Empty if there is none of these. Throws InputError for a file without a token.
std::string find_token(const std::string& given, const std::filesystem::path& file);
/// Writes the live file of a run's folder. Throws RunError.
void write_live_file(const std::filesystem::path& folder, const LiveFile& live);

struct WhatToWatch {
    std::filesystem::path folder;    // of the run; may be empty
    std::optional<Address> address;  // of the trainer; else the folder's live file has it
    std::string token;
    // A splats.ply that is not newer than this is ignored.
    std::filesystem::file_time_type splats_after = std::filesystem::file_time_type::min();
    std::filesystem::file_time_type metrics_after = std::filesystem::file_time_type::min();
    std::chrono::milliseconds patience = kPatience;  // with a trainer that does not answer
};

struct Update {
    Status status;                            // with all metrics
    std::shared_ptr<const Gaussians> splats;  // the newest; null if there are none yet
    std::vector<bool> frozen;  // of each of the splats: whether no step changes it; empty: none is
    int splats_step = -1;
    uint64_t number = 0;                 // grows with every change
    bool connected = false;              // to the trainer, not only to its files
    std::string problem;                 // why there is nothing new; one line, or empty
    uint64_t edits = 0;                  // of this watcher that were answered
    std::optional<EditReply> last_edit;  // the answer to the last one; empty if it was refused
    std::string edit_refusal;            // why; one line, or empty
};

class Watcher {
  public:
    /// on_news: called on the watcher's thread after each change of update().
    Watcher(WhatToWatch what, std::function<void()> on_news);
    ~Watcher();

    Update update() const;
    uint64_t number() const;  // of the update
    /// name: pause, resume or save. update().problem has the reason of a refusal. A pause lasts while this watcher exists, and 10
    /// seconds longer.
    void command(const std::string& name);
    /// Edits the splats of the training. update().edits grows when the answer has come.
    void edit(const std::string& body);

  private:
    void work();
    void look();
    void look_by_connection();
    void look_at_files();
    void read_metrics();
    void change(const std::function<void(Update&)>& change);
    struct Command {
        std::string name;
        std::optional<std::string> edit = {};  // its body, in place of a name
    };
    void add(Command command);
    std::optional<Command> next_command();
    void send(const Command& command);
    void note_edit(const std::optional<EditReply>& reply, const std::string& refusal);

    const WhatToWatch what_;
    std::function<void()> on_news_;
    // Only the thread uses it.
    std::unique_ptr<Client> client_;
    std::string run_, tag_;  // the run and the splats of the last update; empty: unknown
    std::filesystem::file_time_type splats_time_;
    std::uintmax_t metrics_read_ = 0;

    mutable std::mutex mutex_;
    std::condition_variable wake_;
    Update update_;
    std::vector<Command> commands_;
    std::atomic<bool> stop_ = false;
    std::thread thread_;
};

}  // namespace ewa::live
