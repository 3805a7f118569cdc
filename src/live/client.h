// SPDX-License-Identifier: Apache-2.0
// The watcher's side of the HTTP server in server.h.
#pragma once
#include <atomic>
#include <memory>
#include <optional>
#include <string>

#include "ewa/gaussians.h"
#include "live/status.h"

namespace ewa::live {

struct Address {
    std::string host;
    uint16_t port = 0;
};
/// "host:port", "[v6]:port" or ":port" (this machine). Throws InputError.
Address parse_address(const std::string& text);

/// Splats of a run, and the tag by which the server knows them.
struct TaggedSplats {
    int step = 0;
    std::string tag;
    Gaussians gaussians;
};

/// Each request has a connection of its own. What comes back may be from anybody: sizes are bounded, and
/// memory is taken for what has come alone.
class Client {
  public:
    /// Connects nowhere yet. token: empty for watching without commands. stop: may be null; once it is true
    /// every wait ends at once, as an error.
    Client(const Address& address, const std::string& token, const std::atomic<bool>* stop = nullptr);
    ~Client();

    // Each throws InputError for a refusal or an answer that is no trainer's, and RunError where nobody
    // answers or the connection ends.

    /// With the metrics from line `first_line` on.
    Status status(size_t first_line);
    /// Other splats than those with this tag, or nothing where there are none. tag: empty for any.
    std::optional<TaggedSplats> splats(const std::string& tag);
    /// pause, resume or save.
    void command(const std::string& name);

  private:
    class Http;
    std::unique_ptr<Http> http_;
};

}  // namespace ewa::live
