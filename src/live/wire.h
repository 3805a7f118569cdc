// SPDX-License-Identifier: Apache-2.0
// The socket of one HTTP exchange, as cpp-httplib reads and writes it. cpp-httplib limits the time of single reads
// and writes, and the length of single headers. This limits the whole.
#pragma once
#include <httplib.h>

#include <atomic>
#include <chrono>

namespace ewa::live {

class Wire final : public httplib::Stream {
  public:
    /// socket: not owned. bytes: how many may come, all within `patience`. stop: may be null. Once it is true,
    /// every wait ends as if the other side had gone.
    Wire(socket_t socket, uint64_t bytes, std::chrono::milliseconds patience,
         const std::atomic<bool>* stop = nullptr,
         std::chrono::milliseconds write_grace = std::chrono::seconds(30));

    /// Allows so many further bytes to arrive. From now on, `patience` limits each wait for bytes, not the whole exchange.
    void allow(uint64_t bytes);

    bool is_readable() const override { return left_ > 0; }
    bool is_writable() const override { return true; }
    /// Returns the number of bytes that came, or -1 at any limit.
    ssize_t read(char* to, size_t size) override;
    /// Writes all or returns -1. Writing may take write_grace, and a second more for each 16 KB that the other side has
    /// taken. It ends if that takes nothing for half of write_grace. What lies in this system's buffer is not taken.
    ssize_t write(const char* from, size_t size) override;
    void get_remote_ip_and_port(std::string&, int&) const override {}
    void get_local_ip_and_port(std::string&, int&) const override {}
    socket_t socket() const override { return socket_; }

  private:
    using Clock = std::chrono::steady_clock;
    bool ready(bool to_write, Clock::time_point due) const;
    bool writable();

    const socket_t socket_;
    uint64_t left_;  // bytes that may come
    uint64_t written_ = 0;
    const std::chrono::milliseconds patience_, write_grace_;
    const std::atomic<bool>* const stop_;
    Clock::time_point due_;
    bool each_wait_ = false;
    Clock::time_point first_write_{};
};

}  // namespace ewa::live
