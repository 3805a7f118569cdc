// SPDX-License-Identifier: Apache-2.0
// Threads that compile pipelines in the background.
#pragma once
#include <cstddef>
#include <functional>
#include <future>
#include <map>
#include <mutex>
#include <vector>

namespace ewa::gpu {

class CompileThreads {
  public:
    /// most: threads at one time.
    explicit CompileThreads(size_t most) : most_(most) {}
    /// Waits for the threads. Jobs that have not begun are dropped.
    ~CompileThreads();
    CompileThreads(const CompileThreads&) = delete;

    /// Calls `work` on a thread, larger work first. If no thread can start, `work` is not called, so the caller must manage
    /// without its result. `work` must not throw.
    void add(size_t size, std::function<void()> work);

  private:
    void run();

    size_t most_;
    std::mutex mutex_;
    std::multimap<size_t, std::function<void()>> waiting_;  // by size
    size_t running_ = 0;
    std::vector<std::future<void>> threads_;
};

}  // namespace ewa::gpu
