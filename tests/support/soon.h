// SPDX-License-Identifier: Apache-2.0
// Waiting for a condition instead of a time.
#pragma once
#include <chrono>
#include <thread>

namespace ewa::test {

/// Asks again and again until it holds. False where it does not within `seconds`, which allow for a busy
/// machine.
template <class Holds>
bool soon(const Holds& holds, double seconds = 60) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    do {
        if (holds()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    } while (std::chrono::steady_clock::now() < until);
    return false;
}

}  // namespace ewa::test
