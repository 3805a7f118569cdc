// SPDX-License-Identifier: Apache-2.0
// TCP, as far as watching a run needs it: every wait has an end.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace ewa::live {

/// A connection. Movable; closed at the end of its life.
class Socket {
  public:
    Socket() = default;
    /// stop: every wait ends as if the other side had gone once it is true; null: none does. Outlives the
    /// socket.
    explicit Socket(int descriptor, const std::atomic<bool>* stop = nullptr)
        : descriptor_(descriptor), stop_(stop) {}
    ~Socket();
    Socket(Socket&& other) noexcept;
    Socket& operator=(Socket&& other) noexcept;

    explicit operator bool() const { return descriptor_ >= 0; }
    int descriptor() const { return descriptor_; }

    /// False where the other side has gone or a pause of `seconds` came.
    bool send(std::span<const std::byte> bytes, int seconds) const;
    bool send(const std::string& text, int seconds) const;
    /// Exactly these bytes; false as above.
    bool receive(std::span<std::byte> bytes, int seconds) const;
    /// Up to "\n", which is not among what comes back. Nothing where the other side has gone, took longer
    /// than `seconds` from the first byte to the last, or the line is longer than `most`.
    std::optional<std::string> receive_line(size_t most, int seconds) const;
    /// Wakes whoever waits in it; they find the connection at its end.
    void shut() const;

  private:
    int descriptor_ = -1;
    const std::atomic<bool>* stop_ = nullptr;
};

/// host: a name or a number, e.g. "localhost", "10.0.0.7", "::1". stop: as Socket has it. Throws RunError
/// with the reason.
Socket connect_to(const std::string& host, uint16_t port, int seconds,
                  const std::atomic<bool>* stop = nullptr);

class Listener {
  public:
    /// address: what to listen on, e.g. "127.0.0.1". port 0: any that is free. Throws RunError.
    Listener(const std::string& address, uint16_t port);
    uint16_t port() const { return port_; }
    /// The next connection; none after `seconds` or a shut().
    Socket accept(int seconds) const;
    void shut() const { socket_.shut(); }

  private:
    Socket socket_;
    uint16_t port_ = 0;
};

/// "host:port", "[v6]:port" or ":port" (this machine). Throws InputError.
struct Address {
    std::string host;
    uint16_t port = 0;
};
Address parse_address(const std::string& text);

}  // namespace ewa::live
