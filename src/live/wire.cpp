// SPDX-License-Identifier: Apache-2.0
#include "live/wire.h"

#include <algorithm>
#include <cstdint>

#include "platform/socket.h"

namespace ewa::live {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kNap(100);    // between looks at `stop`
constexpr uint64_t kLeastRate = 16;  // bytes a millisecond that a reader must take

}  // namespace

Wire::Wire(socket_t socket, uint64_t bytes, milliseconds patience, const std::atomic<bool>* stop,
           milliseconds write_grace)
    : socket_(socket),
      left_(bytes),
      patience_(patience),
      write_grace_(write_grace),
      stop_(stop),
      due_(Clock::now() + patience) {}

void Wire::allow(uint64_t bytes) {
    left_ += bytes;
    each_wait_ = true;
}

bool Wire::ready(bool to_write, Clock::time_point due) const {
    for (;;) {
        if (stop_ && *stop_) return false;
        const auto left = std::max(milliseconds(0), std::chrono::ceil<milliseconds>(due - Clock::now()));
        const auto nap = stop_ ? std::min(left, kNap) : left;
        const auto wait = to_write ? platform::wait_to_write : platform::wait_to_read;
        const platform::Waiting result = wait(std::intptr_t(socket_), nap);
        if (result != platform::Waiting::timeout) return result == platform::Waiting::ready;
        if (Clock::now() >= due) return false;
    }
}

ssize_t Wire::read(char* to, size_t size) {
    size = size_t(std::min<uint64_t>(size, left_));
    if (size == 0) return -1;
    for (;;) {
        if (!ready(false, each_wait_ ? Clock::now() + patience_ : due_)) return -1;
        const std::ptrdiff_t got = platform::receive_now(std::intptr_t(socket_), to, size);
        if (got == platform::kAgain) continue;
        if (got > 0) left_ -= uint64_t(got);
        return got;
    }
}

bool Wire::writable() {
    Clock::time_point moved = Clock::now();  // when the other side last took something
    uint64_t waiting = UINT64_MAX;           // bytes that it has not taken
    for (;;) {
        const Clock::time_point now = Clock::now();
        const uint64_t left = platform::not_taken(std::intptr_t(socket_));
        if (left < waiting) moved = now;
        waiting = left;
        const uint64_t taken = written_ - std::min(written_, left);
        const Clock::time_point due = std::min(
            moved + write_grace_ / 2, first_write_ + write_grace_ + milliseconds(taken / kLeastRate));
        if (now >= due || (stop_ && *stop_)) return false;
        if (ready(true, std::min(due, now + kNap))) return true;
    }
}

ssize_t Wire::write(const char* from, size_t size) {
    if (written_ == 0) first_write_ = Clock::now();
    size_t sent = 0;
    while (sent < size) {
        if (!writable()) return -1;
        const std::ptrdiff_t now = platform::send_now(std::intptr_t(socket_), from + sent, size - sent);
        if (now == platform::kAgain) continue;
        if (now <= 0) return -1;
        sent += size_t(now);
        written_ += uint64_t(now);
    }
    return ssize_t(size);
}

}  // namespace ewa::live
