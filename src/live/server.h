// SPDX-License-Identifier: Apache-2.0
// The trainer's side: lets others look on (protocol.h). The training loop leaves here what there is to see,
// and never waits for whoever sees it.
#pragma once
#include <atomic>
#include <chrono>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <thread>

#include "live/protocol.h"
#include "live/socket.h"

namespace ewa::live {

class Server {
  public:
    /// token: what commands are taken for; empty: from nobody. silence: after which one's place may go to a
    /// newcomer. Throws RunError where the address cannot be listened on.
    Server(const std::string& address, uint16_t port, std::string token,
           std::chrono::seconds silence = std::chrono::seconds(kSilence));
    ~Server();
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    uint16_t port() const { return listener_.port(); }

    // For the training loop's thread.

    /// What status answers with; its metrics and commands are not looked at.
    void report(const Status& status);
    void add_metrics(const report::MetricsLine& line);
    /// Whether splats of this step should be taken: somebody asked since the last ones, and taking them costs
    /// at most a twentieth of the time.
    bool wants_splats(int step) const;
    /// Splats, and how long taking them took.
    void offer(Snapshot&& snapshot, double seconds);
    bool paused() const { return paused_; }
    /// Whether a saving has been asked for since the last call.
    bool take_save() { return save_.exchange(false); }

  private:
    using Clock = std::chrono::steady_clock;
    struct Client {
        Socket socket;
        std::thread thread;
        std::atomic<bool> done = false;
        std::atomic<bool> trusted = false;                    // it has shown the token
        std::atomic<bool> waiting = false;                    // it has no place, and has to show the token
        std::atomic<bool> asking = false;                     // a request of it is being answered
        std::atomic<Clock::time_point> heard = Clock::now();  // the end of its last request
        bool paused = false;                                  // it holds the training
    };
    void listen();
    /// Whether there is a place for a newcomer, once one that is silent has given way.
    bool make_room();
    /// Ends the one silent longest, for `least` at least, of those without the token that wait or that do
    /// not.
    bool end_silent(bool waiting, Clock::duration least);
    size_t count(std::atomic<bool> Client::*which) const;
    void serve(Client& client);
    /// False: the connection ends.
    bool answer(Client& client, const std::string& request);
    bool take_token(Client& client, const std::string& token);
    bool give(const Socket& socket, std::span<const std::byte> payload) const;
    bool give(const Socket& socket, const std::string& payload) const;
    std::string status_from(size_t line, bool trusted) const;
    std::shared_ptr<const Snapshot> splats_after(int step);
    void forget_finished();

    const std::string token_;
    const Clock::duration silence_;
    Listener listener_;
    mutable std::mutex mutex_;
    Status status_;
    std::shared_ptr<const Snapshot> snapshot_;
    Clock::time_point next_snapshot_;
    std::list<Client> clients_;
    std::atomic<int> trusted_ = 0;  // of the clients
    std::atomic<bool> wanted_ = false, paused_ = false, save_ = false, stop_ = false;
    std::thread thread_;  // last
};

/// 128 bits from the system's source, as text.
std::string random_token();

}  // namespace ewa::live
