// SPDX-License-Identifier: Apache-2.0
// What cpp-httplib leaves to its users: waiting for sockets, the address of a host, and the signal of a closed pipe. A socket is
// the system's number of it.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace ewa::platform {

enum class Waiting { ready, timeout, failed };

/// Waits until bytes can be read, or written.
Waiting wait_to_read(std::intptr_t socket, std::chrono::milliseconds time);
Waiting wait_to_write(std::intptr_t socket, std::chrono::milliseconds time);

constexpr std::ptrdiff_t kAgain = -2;  // nothing was ready after all

/// Receives or sends what is possible without waiting. Returns the number of bytes, kAgain, or -1. receive: 0 at the end.
std::ptrdiff_t receive_now(std::intptr_t socket, char* to, size_t size);
std::ptrdiff_t send_now(std::intptr_t socket, const char* from, size_t size);

/// The bytes that were sent and that the other side has not taken. 0 where the system does not say.
uint64_t not_taken(std::intptr_t socket);

/// Ends both directions. A thread that waits for the socket returns.
void shut_down(std::intptr_t socket);
void close_socket(std::intptr_t socket);

/// Lets the socket listen on a port that was used a moment ago, and on none that another process listens on.
void reuse_port(std::intptr_t socket);

/// Whether the text is an address in numbers.
bool is_ipv4(const std::string& text);
bool is_ipv6(const std::string& text);

/// Before a call that opens sockets: clears the last error. After it: the words of that error, empty without one.
void clear_socket_error();
std::string socket_error();

/// Keeps what this process does on a write to a closed pipe, from the constructor to restore(). Windows: there is no such signal.
class PipeSignal {
  public:
    PipeSignal();
    ~PipeSignal();
    void restore();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace ewa::platform
