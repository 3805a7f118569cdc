// SPDX-License-Identifier: Apache-2.0
#include "live/socket.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <memory>
#include <utility>

#include "core/text.h"
#include "ewa/error.h"

namespace ewa::live {
namespace {

using Clock = std::chrono::steady_clock;

constexpr long long kNap = 100;  // ms between looks at `stop`

/// Whether the descriptor is ready before `due` and before it is to stop.
bool ready(int descriptor, short events, Clock::time_point due, const std::atomic<bool>* stop) {
    for (;;) {
        if (stop && *stop) return false;
        const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(due - Clock::now()).count();
        const long long nap = std::max<long long>(0, stop ? std::min<long long>(left, kNap) : left);
        pollfd waiting{descriptor, events, 0};
        const int result = poll(&waiting, 1, int(nap));
        if (result > 0) return (waiting.revents & POLLNVAL) == 0;
        if (result < 0 && errno != EINTR) return false;
        if (result == 0 && left <= nap) return false;
    }
}

Clock::time_point after(int seconds) {
    return Clock::now() + std::chrono::seconds(seconds);
}

using Addresses = std::unique_ptr<addrinfo, void (*)(addrinfo*)>;

Addresses look_up(const std::string& host, uint16_t port, bool passive) {
    addrinfo hints{}, *found = nullptr;
    hints.ai_family = AF_UNSPEC;
    hints.ai_socktype = SOCK_STREAM;
    hints.ai_flags = passive ? AI_PASSIVE | AI_NUMERICHOST : 0;
    const int status = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found);
    if (status != 0)
        throw RunError("the address " + host + " is not found: " +
                       (status == EAI_SYSTEM ? std::strerror(errno) : gai_strerror(status)));
    return {found, freeaddrinfo};
}

}  // namespace

Socket::~Socket() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

Socket::Socket(Socket&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), stop_(other.stop_) {}

Socket& Socket::operator=(Socket&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    std::swap(stop_, other.stop_);
    return *this;
}

void Socket::shut() const {
    if (descriptor_ >= 0) ::shutdown(descriptor_, SHUT_RDWR);
}

bool Socket::send(std::span<const std::byte> bytes, int seconds) const {
    while (!bytes.empty()) {
        if (!ready(descriptor_, POLLOUT, after(seconds), stop_)) return false;
        const ssize_t sent = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent < 0 && (errno == EINTR || errno == EAGAIN)) continue;
        if (sent <= 0) return false;
        bytes = bytes.subspan(size_t(sent));
    }
    return true;
}

bool Socket::send(const std::string& text, int seconds) const {
    return send(std::as_bytes(std::span(text)), seconds);
}

bool Socket::receive(std::span<std::byte> bytes, int seconds) const {
    while (!bytes.empty()) {
        if (!ready(descriptor_, POLLIN, after(seconds), stop_)) return false;
        const ssize_t got = ::recv(descriptor_, bytes.data(), bytes.size(), MSG_DONTWAIT);
        if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
        if (got <= 0) return false;
        bytes = bytes.subspan(size_t(got));
    }
    return true;
}

std::optional<std::string> Socket::receive_line(size_t most, int seconds) const {
    const auto due = after(seconds);
    std::string line;
    while (line.size() < most) {
        char c = 0;
        if (!ready(descriptor_, POLLIN, due, stop_)) return std::nullopt;
        const ssize_t got = ::recv(descriptor_, &c, 1, MSG_DONTWAIT);
        if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
        if (got <= 0) return std::nullopt;
        if (c == '\n') return line;
        line += c;
    }
    return std::nullopt;
}

Socket connect_to(const std::string& host, uint16_t port, int seconds, const std::atomic<bool>* stop) {
    const Addresses addresses = look_up(host.empty() ? "localhost" : host, port, false);
    std::string reason = "no address";
    for (const addrinfo* at = addresses.get(); at; at = at->ai_next) {
        Socket socket(::socket(at->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0), stop);
        int status = socket ? ::connect(socket.descriptor(), at->ai_addr, at->ai_addrlen) : -1;
        if (status != 0 && errno == EINPROGRESS) {
            if (!ready(socket.descriptor(), POLLOUT, after(seconds), stop)) {
                reason = "no answer";
                continue;
            }
            int error = 0;
            socklen_t size = sizeof(error);
            getsockopt(socket.descriptor(), SOL_SOCKET, SO_ERROR, &error, &size);
            status = error == 0 ? 0 : -1;
            errno = error;
        }
        if (status == 0) return socket;
        reason = std::strerror(errno);
    }
    throw RunError("cannot reach " + host + ":" + std::to_string(port) + ": " + reason);
}

Listener::Listener(const std::string& address, uint16_t port) {
    const Addresses addresses = look_up(address, port, true);
    const addrinfo& at = *addresses;
    socket_ = Socket(::socket(at.ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
    const int yes = 1;
    sockaddr_storage own{};
    socklen_t size = sizeof(own);
    if (!socket_ || ::setsockopt(socket_.descriptor(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes)) != 0 ||
        ::bind(socket_.descriptor(), at.ai_addr, at.ai_addrlen) != 0 ||
        ::listen(socket_.descriptor(), 4) != 0 ||
        getsockname(socket_.descriptor(), reinterpret_cast<sockaddr*>(&own), &size) != 0)
        throw RunError("cannot listen on " + address + ":" + std::to_string(port) + ": " +
                       std::strerror(errno));
    port_ = ntohs(own.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(own).sin6_port
                                            : reinterpret_cast<sockaddr_in&>(own).sin_port);
}

Socket Listener::accept(int seconds) const {
    if (!ready(socket_.descriptor(), POLLIN, after(seconds), nullptr)) return {};
    Socket socket(::accept4(socket_.descriptor(), nullptr, nullptr, SOCK_CLOEXEC));
    const int yes = 1;
    if (socket) setsockopt(socket.descriptor(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof(yes));
    return socket;
}

Address parse_address(const std::string& text) {
    const size_t colon = text.rfind(':');
    const std::string_view digits =
        colon == std::string::npos ? "" : std::string_view(text).substr(colon + 1);
    const uint16_t port = core::parse_integer<uint16_t>(digits).value_or(0);
    std::string host = text.substr(0, colon == std::string::npos ? 0 : colon);
    if (host.size() >= 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
    if (port == 0) throw InputError("'" + text + "' is no address such as localhost:7000");
    return {host.empty() ? "localhost" : host, port};
}

}  // namespace ewa::live
