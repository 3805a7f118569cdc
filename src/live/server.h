// SPDX-License-Identifier: Apache-2.0
// The trainer's side: an HTTP server through which others watch and command a training run.
//
//   GET /status[?metrics=N]  JSON: see status.h. "metrics" are at most kMostLines lines of metrics.jsonl, from
//                            the N-th on. There are none without ?metrics.
//   GET /splats              The splats as PLY (io/splats/ply.cpp). ETag names them, and Ewa-Step is their step. Where splats are
//                            frozen, the rows end in the property kFrozenProperty, 1 for these and 0 for others.
//                            A request makes the trainer take newer ones. The status is 304 if If-None-Match
//                            names the newest. Without If-None-Match the answer waits up to 5 seconds for
//                            splats of the present step. It is 503 if none have ever been taken.
//   GET /                    A page that follows the run in a browser (web/). Its views come from the splats, so it
//                            waits for them as /splats does, and the browser asks again after a 503.
//   GET /scene               The splats as the page reads them, a SOG (scenes.h). The rest is as with /splats. While
//                            the training runs, the splats may be older ones.
//   POST /pause              Holds the training before its next step. It continues by itself 10 seconds after
//                            the last request with the token.
//   POST /resume, /save      Continue; save splats and checkpoint.
//   POST /edit               Edits the splats before the next step, also during a pause. The body is the edit, at most kMostEdit
//                            bytes with a Content-Length. The answer waits until it is done, and is EditReply as JSON (status.h).
//                            An edit that the trainer refuses is 400. It is 503 if no step ends within kEditWait.
//
// A POST needs "Authorization: Bearer TOKEN". GET works without it. A wrong token is refused everywhere.
// An error is one line of text.
//
// Strangers reach the port. The server therefore
// - refuses a Host that is neither an address in numbers nor localhost (DNS rebinding);
// - refuses every request of a web page (Origin, Sec-Fetch-Site);
// - reads at most 4 KiB of request line and headers, within 2 seconds, and no body but that of an edit with the token;
// - answers one request a connection and 64 connections at a time. A new connection replaces the one that has
//   waited longest without a request;
// - answers kMostStrangers requests without the token at a time. All of these get one set of splats, so slow
//   readers hold no other sets in memory;
// - ends an answer that is read slower than 16 KB/s (wire.h).
#pragma once
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "ewa/gaussians.h"
#include "ewa/splat_scene.h"
#include "live/edit_queue.h"
#include "live/scenes.h"
#include "live/status.h"

namespace ewa::live {

inline constexpr size_t kMostStrangers = 8;
inline constexpr std::chrono::seconds kLease{10}, kRequestPatience{2}, kEditWait{20};
inline constexpr size_t kMostEdit = 256u << 10;  // bytes

struct Snapshot {
    int step = 0;
    Gaussians gaussians;
    std::vector<bool> frozen = {};  // of each splat: whether no step changes it; empty: none is frozen
    uint64_t edits = 0;             // before them in this run; Server::offer sets it
};

/// 128 bits from the system's random source, in hexadecimal. Throws RunError.
std::string random_token();

/// Safe to use from several threads. The training loop never waits for a client.
class Server {
  public:
    /// Listens at once. port 0: any free one. token: empty refuses all commands. lease: how long a pause
    /// outlasts the last request with the token. request_patience: for a whole request. edit_wait: for the step before an edit.
    /// Throws RunError if nothing can listen on the address.
    Server(const std::string& address, uint16_t port, std::string token,
           std::chrono::milliseconds lease = kLease,
           std::chrono::milliseconds request_patience = kRequestPatience,
           std::chrono::milliseconds edit_wait = kEditWait);
    ~Server();
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    uint16_t port() const;

    // For the training loop.

    /// Sets what the page shows besides the splats. options.page.cameras must outlive the server.
    void describe(const SaveOptions& options);
    /// Sets the answer of /status. Members run, commands and metrics are ignored.
    void report(const Status& status);
    void add_metrics(const report::MetricsLine& line);
    /// Whether splats of this step should be taken: somebody asked since the last ones, and taking them
    /// costs at most a twentieth of the time.
    bool wants_splats(int step) const;
    /// Gives the server new splats. seconds: the time that copying them from the trainer took.
    void offer(Snapshot&& snapshot, double seconds);
    bool paused();
    /// Whether a client has requested /save since the last call.
    bool take_save();
    /// Performs the edits that clients wait for: EditQueue::perform.
    bool perform_edits(const std::function<EditReply(const std::string& body)>& perform) {
        return edits_.perform(perform);
    }

  private:
    using Clock = std::chrono::steady_clock;

    class Http;         // accepts connections and answers requests
    bool paused_now();  // under mutex_

    const std::string token_, run_ = random_token();
    const std::chrono::milliseconds lease_, edit_wait_;
    EditQueue edits_;
    mutable std::mutex mutex_;  // of what follows but scenes_ and http_
    std::condition_variable news_;
    Status status_;
    SaveOptions options_;  // of the page
    std::shared_ptr<const Snapshot> splats_;
    std::weak_ptr<const Snapshot> given_;  // to those without the token, while any of them reads it
    Clock::time_point next_splats_, lease_end_;
    size_t trusted_ = 0, strangers_ = 0;  // requests that are being answered
    bool wanted_ = false, paused_ = false, save_ = false, stop_ = false;
    Scenes scenes_;               // has its own mutex
    std::unique_ptr<Http> http_;  // last: its threads use the rest
};

}  // namespace ewa::live
