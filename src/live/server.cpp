// SPDX-License-Identifier: Apache-2.0
#include "live/server.h"

#include <sys/random.h>

#include <algorithm>
#include <utility>

#include "core/text.h"
#include "ewa/error.h"

namespace ewa::live {
namespace {

constexpr double kShare = 0.05;      // of the time that taking splats may cost
constexpr double kLeastPause = 0.2;  // seconds between splats
constexpr int kAcceptSeconds = 1;
const std::string kFull = "no there are " + std::to_string(kMostClients) + " connections already\n";

/// Takes the same time wherever the first difference stands.
bool same_secret(const std::string& a, const std::string& b) {
    if (a.size() != b.size()) return false;
    unsigned difference = 0;
    for (size_t i = 0; i < a.size(); ++i) difference |= unsigned(a[i] ^ b[i]);
    return difference == 0;
}

}  // namespace

std::string random_token() {
    unsigned char bytes[16] = {};
    if (getrandom(bytes, sizeof(bytes), 0) != ssize_t(sizeof(bytes)))
        throw RunError("the system gives no random numbers for a token");
    std::string text;
    for (const unsigned char byte : bytes) {
        text += "0123456789abcdef"[byte >> 4];
        text += "0123456789abcdef"[byte & 15];
    }
    return text;
}

Server::Server(const std::string& address, uint16_t port, std::string token, std::chrono::seconds silence)
    : token_(std::move(token)), silence_(silence), listener_(address, port), thread_([this] { listen(); }) {}

Server::~Server() {
    stop_ = true;
    listener_.shut();
    thread_.join();
    for (Client& client : clients_) client.socket.shut();
    for (Client& client : clients_) client.thread.join();
}

void Server::report(const Status& status) {
    const std::lock_guard lock(mutex_);
    auto metrics = std::move(status_.metrics);
    status_ = status;
    status_.metrics = std::move(metrics);
}

void Server::add_metrics(const report::MetricsLine& line) {
    const std::lock_guard lock(mutex_);
    status_.metrics.push_back(line);
}

bool Server::wants_splats(int step) const {
    if (!wanted_) return false;
    const std::lock_guard lock(mutex_);
    return (!snapshot_ || snapshot_->step != step) && Clock::now() >= next_snapshot_;
}

void Server::offer(Snapshot&& snapshot, double seconds) {
    auto shared = std::make_shared<const Snapshot>(std::move(snapshot));
    const std::lock_guard lock(mutex_);
    snapshot_ = std::move(shared);
    wanted_ = false;
    const std::chrono::duration<double> pause(std::max(kLeastPause, seconds / kShare));
    next_snapshot_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(pause);
}

void Server::forget_finished() {
    clients_.remove_if([](Client& client) {
        if (!client.done) return false;
        client.thread.join();
        return true;
    });
}

size_t Server::count(std::atomic<bool> Client::*which) const {
    return size_t(std::count_if(clients_.begin(), clients_.end(),
                                [which](const Client& client) { return (client.*which).load(); }));
}

bool Server::end_silent(bool waiting, Clock::duration least) {
    auto longest = clients_.end();
    for (auto at = clients_.begin(); at != clients_.end(); ++at)
        if (!at->trusted && !at->asking && at->waiting == waiting &&
            (longest == clients_.end() || at->heard.load() < longest->heard.load()))
            longest = at;
    if (longest == clients_.end() || Clock::now() - longest->heard.load() < least) return false;
    longest->socket.shut();
    longest->thread.join();
    clients_.erase(longest);
    return true;
}

bool Server::make_room() {
    const size_t placed = clients_.size() - count(&Client::waiting);
    return placed < size_t(kMostClients) || end_silent(false, silence_);
}

void Server::listen() {
    while (!stop_) {
        Socket socket = listener_.accept(kAcceptSeconds);
        forget_finished();
        if (!socket || stop_) continue;
        const bool waiting = !make_room();
        const bool full = waiting && count(&Client::waiting) >= size_t(kMostClients) &&
                          !end_silent(true, Clock::duration::zero());
        if (full) {
            socket.send(kFull, 1);
            continue;
        }
        Client& client = clients_.emplace_back();
        client.waiting = waiting;
        client.socket = std::move(socket);
        client.thread = std::thread([this, &client] { serve(client); });
    }
}

void Server::serve(Client& client) {
    try {
        while (!stop_) {
            const auto request =
                client.socket.receive_line(kMostRequest, client.waiting ? kSilence : kPatience);
            if (!request) break;
            client.asking = true;
            const bool goes_on = answer(client, *request);
            client.heard = Clock::now();
            client.asking = false;
            if (!goes_on) break;
        }
    } catch (const std::exception&) {
        // Out of memory for one who watches: the connection ends, the training does not.
    }
    if (client.trusted) --trusted_;
    // Nobody is left who could say go.
    if (client.paused) paused_ = false;
    client.socket.shut();
    client.done = true;
}

bool Server::give(const Socket& socket, std::span<const std::byte> payload) const {
    return socket.send("ok " + std::to_string(payload.size()) + "\n", kPatience) &&
           socket.send(payload, kPatience);
}

bool Server::give(const Socket& socket, const std::string& payload) const {
    return give(socket, std::as_bytes(std::span(payload)));
}

std::string Server::status_from(size_t line, bool trusted) const {
    Status status;
    {
        const std::lock_guard lock(mutex_);
        status = {status_.step,    status_.steps, status_.splats, status_.loss,
                  status_.seconds, status_.state, trusted,        {}};
        const auto& lines = status_.metrics;
        for (size_t i = line; i < lines.size() && i - line < kMostLines; ++i)
            status.metrics.push_back(lines[i]);
    }
    if (status.state == State::running && paused_) status.state = State::paused;
    return encode(status);
}

std::shared_ptr<const Snapshot> Server::splats_after(int step) {
    const std::lock_guard lock(mutex_);
    wanted_ = true;
    return snapshot_ && snapshot_->step > step ? snapshot_ : nullptr;
}

bool Server::take_token(Client& client, const std::string& token) {
    const Socket& socket = client.socket;
    if (token_.empty() || !same_secret(token, token_)) {
        socket.send("no another token\n", 1);
        return false;
    }
    if (client.waiting && trusted_ >= kMostClients) {
        socket.send(kFull, 1);
        return false;
    }
    if (!client.trusted) ++trusted_;
    client.trusted = true;
    client.waiting = false;
    return give(socket, std::string());
}

bool Server::answer(Client& client, const std::string& request) {
    const Socket& socket = client.socket;
    std::string_view rest = request;
    const std::string_view word = core::next_word(rest);
    const std::string argument(core::trim(rest));
    if (request == kHello) return give(socket, std::string());
    if (word == "token") return take_token(client, argument);
    if (client.waiting) {
        socket.send(kFull, 1);
        return false;
    }
    if (word == "status") {
        const auto line = core::parse_integer<uint32_t>(argument);
        return line ? give(socket, status_from(*line, client.trusted))
                    : socket.send("no status wants a number\n", 1);
    }
    if (word == "splats") {
        const auto step = core::parse_integer<int>(argument);
        if (!step) return socket.send("no splats wants a step\n", 1);
        const auto snapshot = splats_after(*step);
        return give(socket, snapshot ? encode(*snapshot) : std::vector<std::byte>());
    }
    if (word != "pause" && word != "go" && word != "save")
        return socket.send("no there is no such request\n", 1);
    if (!client.trusted) return socket.send("no this needs the token\n", 1);
    if (word == "save")
        save_ = true;
    else
        paused_ = client.paused = word == "pause";
    return give(socket, std::string());
}

}  // namespace ewa::live
