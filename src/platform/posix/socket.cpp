// SPDX-License-Identifier: Apache-2.0
#include "platform/socket.h"

#include <arpa/inet.h>
#include <linux/sockios.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

namespace ewa::platform {
namespace {

Waiting wait(std::intptr_t socket, short events, std::chrono::milliseconds time) {
    pollfd waiting{int(socket), events, 0};
    const int result = poll(&waiting, 1, int(time.count()));
    if (result > 0) return Waiting::ready;
    return result < 0 && errno != EINTR ? Waiting::failed : Waiting::timeout;
}

std::ptrdiff_t checked(ssize_t count) {
    const bool again = errno == EINTR || errno == EAGAIN || errno == EWOULDBLOCK;
    return count < 0 && again ? kAgain : count;
}

bool is_address(int family, const std::string& text) {
    unsigned char address[16];
    return inet_pton(family, text.c_str(), address) == 1;
}

}  // namespace

Waiting wait_to_read(std::intptr_t socket, std::chrono::milliseconds time) {
    return wait(socket, POLLIN, time);
}

Waiting wait_to_write(std::intptr_t socket, std::chrono::milliseconds time) {
    return wait(socket, POLLOUT, time);
}

std::ptrdiff_t receive_now(std::intptr_t socket, char* to, size_t size) {
    return checked(recv(int(socket), to, size, MSG_DONTWAIT));
}

std::ptrdiff_t send_now(std::intptr_t socket, const char* from, size_t size) {
    return checked(send(int(socket), from, size, MSG_NOSIGNAL | MSG_DONTWAIT));
}

uint64_t not_taken(std::intptr_t socket) {
    int left = 0;
    return ioctl(int(socket), SIOCOUTQ, &left) != 0 || left < 0 ? 0 : uint64_t(left);
}

void shut_down(std::intptr_t socket) {
    shutdown(int(socket), SHUT_RDWR);
}

void close_socket(std::intptr_t socket) {
    close(int(socket));
}

void reuse_port(std::intptr_t socket) {
    const int yes = 1;
    setsockopt(int(socket), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
}

bool is_ipv4(const std::string& text) {
    return is_address(AF_INET, text);
}

bool is_ipv6(const std::string& text) {
    return is_address(AF_INET6, text);
}

void clear_socket_error() {
    errno = 0;
}

std::string socket_error() {
    return errno ? std::strerror(errno) : "";
}

struct PipeSignal::State {
    struct sigaction action {};
};

PipeSignal::PipeSignal() : state_(std::make_unique<State>()) {
    sigaction(SIGPIPE, nullptr, &state_->action);
}

PipeSignal::~PipeSignal() = default;

void PipeSignal::restore() {
    sigaction(SIGPIPE, &state_->action, nullptr);
}

}  // namespace ewa::platform
