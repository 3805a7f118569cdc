// SPDX-License-Identifier: Apache-2.0
// A client that keeps to no rules, and a server that answers whatever a test says.
#pragma once
#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

namespace ewa::test {

inline sockaddr_in loopback(uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
}

class RawSocket {
  public:
    explicit RawSocket(int descriptor) : descriptor_(descriptor) {}
    /// A connection to the port. small: takes few bytes before they are read.
    explicit RawSocket(uint16_t port, bool small = false)
        : descriptor_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        const int bytes = 4096;
        if (small) setsockopt(descriptor_, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof(bytes));
        const sockaddr_in to = loopback(port);
        if (connect(descriptor_, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) != 0)
            throw std::runtime_error("cannot connect");
    }
    ~RawSocket() {
        if (descriptor_ >= 0) close(descriptor_);
    }
    RawSocket(RawSocket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
    RawSocket& operator=(RawSocket&&) = delete;

    /// False once the other side has gone.
    bool send(const std::string& text) const {
        size_t sent = 0;
        while (sent < text.size()) {
            const ssize_t now = ::send(descriptor_, text.data() + sent, text.size() - sent, MSG_NOSIGNAL);
            if (now <= 0) return false;
            sent += size_t(now);
        }
        return true;
    }
    /// All until the other side ends, or `most` bytes; waits a minute at most for each.
    std::string receive(size_t most = SIZE_MAX) const {
        std::string text;
        char bytes[4096];
        while (text.size() < most) {
            pollfd waiting{descriptor_, POLLIN, 0};
            if (poll(&waiting, 1, 60000) <= 0) throw std::runtime_error("nothing comes, and no end");
            const ssize_t got = recv(descriptor_, bytes, std::min(sizeof(bytes), most - text.size()), 0);
            if (got <= 0) return text;
            text.append(bytes, size_t(got));
        }
        return text;
    }
    /// Whether the other side has ended the connection by now.
    bool ended() const {
        char byte = 0;
        const ssize_t got = recv(descriptor_, &byte, 1, MSG_PEEK | MSG_DONTWAIT);
        return got == 0 || (got < 0 && errno != EAGAIN);
    }

  private:
    int descriptor_;
};

/// Answers each connection with the same bytes, whatever it asks. Without bytes it stays silent.
class RawServer {
  public:
    explicit RawServer(std::string answer)
        : answer_(std::move(answer)), listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        sockaddr_in at = loopback(0);
        socklen_t size = sizeof(at);
        if (bind(listener_, reinterpret_cast<sockaddr*>(&at), size) != 0 || listen(listener_, 5) != 0 ||
            getsockname(listener_, reinterpret_cast<sockaddr*>(&at), &size) != 0)
            throw std::runtime_error("cannot listen");
        port_ = ntohs(at.sin_port);
        thread_ = std::thread([this] { serve(); });
    }
    ~RawServer() {
        shutdown(listener_, SHUT_RDWR);
        thread_.join();
        close(listener_);
    }
    uint16_t port() const { return port_; }
    int requests() const { return requests_; }

  private:
    void serve() {
        for (;;) {
            const int client = accept(listener_, nullptr, nullptr);
            if (client < 0) return;
            const RawSocket socket(client);
            socket.receive(1);
            ++requests_;
            socket.send(answer_);
            if (!answer_.empty()) shutdown(client, SHUT_WR);
            char rest[4096];
            while (recv(client, rest, sizeof(rest), 0) > 0) {
            }
        }
    }

    std::string answer_;
    int listener_;
    uint16_t port_ = 0;
    std::atomic<int> requests_ = 0;
    std::thread thread_;
};

}  // namespace ewa::test
