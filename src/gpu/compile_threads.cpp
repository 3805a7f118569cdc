// SPDX-License-Identifier: Apache-2.0
#include "gpu/compile_threads.h"

#include <chrono>
#include <iterator>
#include <system_error>
#include <utility>

namespace ewa::gpu {

CompileThreads::~CompileThreads() {
    {
        const std::lock_guard lock(mutex_);
        waiting_.clear();
    }
    threads_.clear();  // a future of std::async waits for its thread
}

void CompileThreads::add(size_t size, std::function<void()> work) {
    const std::lock_guard lock(mutex_);
    waiting_.emplace(size, std::move(work));
    if (running_ >= most_) return;
    std::erase_if(threads_, [](const std::future<void>& thread) {
        return thread.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    });
    threads_.reserve(threads_.size() + 1);  // a thread that is lost by bad_alloc would wait for the mutex
    try {
        threads_.push_back(std::async(std::launch::async, [this] { run(); }));
        ++running_;
    } catch (const std::system_error&) {
        // Who needs the pipeline compiles it.
    }
}

void CompileThreads::run() {
    for (;;) {
        std::function<void()> work;
        {
            const std::lock_guard lock(mutex_);
            if (waiting_.empty()) {
                --running_;
                return;
            }
            const auto largest = std::prev(waiting_.end());
            work = std::move(largest->second);
            waiting_.erase(largest);
        }
        work();
    }
}

}  // namespace ewa::gpu
