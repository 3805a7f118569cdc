// SPDX-License-Identifier: Apache-2.0
#include "platform/socket.h"

#include "platform/windows/windows.h"
// After windows.h.
#include <ws2tcpip.h>

namespace ewa::platform {
namespace {

SOCKET socket_of(std::intptr_t socket) {
    return SOCKET(socket);
}

Waiting wait(std::intptr_t socket, short events, std::chrono::milliseconds time) {
    WSAPOLLFD waiting{socket_of(socket), events, 0};
    const int result = WSAPoll(&waiting, 1, int(time.count()));
    return result > 0 ? Waiting::ready : result < 0 ? Waiting::failed : Waiting::timeout;
}

/// Windows has no call that alone does not wait, so the socket does not wait from the first call on.
void never_wait(std::intptr_t socket) {
    u_long yes = 1;
    ioctlsocket(socket_of(socket), FIONBIO, &yes);
}

std::ptrdiff_t checked(int count) {
    return count < 0 && WSAGetLastError() == WSAEWOULDBLOCK ? kAgain : count;
}

int at_once(size_t size) {
    constexpr size_t kMost = 1u << 30;
    return int(size < kMost ? size : kMost);
}

bool is_address(int family, const std::string& text) {
    unsigned char address[16];
    return inet_pton(family, text.c_str(), address) == 1;
}

}  // namespace

Waiting wait_to_read(std::intptr_t socket, std::chrono::milliseconds time) {
    return wait(socket, POLLRDNORM, time);
}

Waiting wait_to_write(std::intptr_t socket, std::chrono::milliseconds time) {
    return wait(socket, POLLWRNORM, time);
}

std::ptrdiff_t receive_now(std::intptr_t socket, char* to, size_t size) {
    never_wait(socket);
    return checked(recv(socket_of(socket), to, at_once(size), 0));
}

std::ptrdiff_t send_now(std::intptr_t socket, const char* from, size_t size) {
    never_wait(socket);
    return checked(send(socket_of(socket), from, at_once(size), 0));
}

uint64_t not_taken(std::intptr_t) {
    return 0;
}

void shut_down(std::intptr_t socket) {
    shutdown(socket_of(socket), SD_BOTH);
}

void close_socket(std::intptr_t socket) {
    closesocket(socket_of(socket));
}

// Windows gives such a port by itself. SO_REUSEADDR would give one that another process listens on.
void reuse_port(std::intptr_t socket) {
    const int yes = 1;
    setsockopt(socket_of(socket), SOL_SOCKET, SO_EXCLUSIVEADDRUSE, reinterpret_cast<const char*>(&yes),
               sizeof(yes));
}

bool is_ipv4(const std::string& text) {
    return is_address(AF_INET, text);
}

bool is_ipv6(const std::string& text) {
    return is_address(AF_INET6, text);
}

void clear_socket_error() {
    WSASetLastError(0);
}

std::string socket_error() {
    const int error = WSAGetLastError();
    return error ? error_words(DWORD(error)) : "";
}

struct PipeSignal::State {};
PipeSignal::PipeSignal() = default;
PipeSignal::~PipeSignal() = default;
void PipeSignal::restore() {}

}  // namespace ewa::platform
