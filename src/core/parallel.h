// SPDX-License-Identifier: Apache-2.0
// Loops on all cores.
#pragma once
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <future>
#include <thread>
#include <vector>

namespace ewa::core {

/// Calls work(i) for each i < count on all cores. The calls must be independent, because their order is not fixed. If a call
/// throws, its exception is thrown after all threads have ended. most: calls at one time.
template <class Work>
void on_all_cores(size_t count, const Work& work, size_t most = SIZE_MAX) {
    std::atomic<size_t> next{0};
    std::vector<std::future<void>> threads;
    const size_t cores = std::max(1u, std::thread::hardware_concurrency());
    for (size_t t = 0; t < std::min({cores, count, most}); ++t)
        threads.push_back(std::async(std::launch::async, [&] {
            for (size_t i = next++; i < count; i = next++) work(i);
        }));
    for (std::future<void>& thread : threads) thread.wait();
    for (std::future<void>& thread : threads) thread.get();
}

}  // namespace ewa::core
