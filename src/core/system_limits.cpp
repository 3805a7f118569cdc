// SPDX-License-Identifier: Apache-2.0
#include "core/system_limits.h"

#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "platform/system.h"

namespace ewa::core {

std::string address_limit_text() {
    const uint64_t limit = platform::address_limit();
    if (limit == UINT64_MAX) return "";
    return "this process may use only " + std::to_string(limit >> 20) + " MiB of address space (ulimit -v); ";
}

bool has_room(uint64_t bytes, int threads) {
    const platform::Reservation reserved(bytes);
    if (!reserved) return false;
    bool started = true;
    // The threads wait for this lock. A std::latch may wait for ever with MinGW, whose atomics miss a notification.
    std::mutex end;
    std::unique_lock held(end);
    std::vector<std::jthread> all;
    try {
        for (int i = 0; i < threads; ++i) all.emplace_back([&end] { const std::lock_guard waits(end); });
    } catch (const std::system_error&) {
        started = false;
    }
    held.unlock();
    return started;
}

}  // namespace ewa::core
