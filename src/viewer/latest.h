// SPDX-License-Identifier: Apache-2.0
// Work that takes long, on a thread of its own.
#pragma once
#include <chrono>
#include <condition_variable>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

namespace ewa::viewer {

/// Work on a thread of its own. The destructor waits until it ends.
template <class Result>
class Task {
  public:
    /// Starts the work. No other may be running. wake: called on the thread, once ready() is true.
    template <class Work>
    void start(std::function<void()> wake, Work work) {
        std::packaged_task<Result()> task(std::move(work));
        result_ = task.get_future();
        thread_ = std::jthread([task = std::move(task), wake = std::move(wake)]() mutable {
            task();
            wake();
        });
    }
    /// From start() to take().
    bool running() const { return result_.valid(); }
    bool ready() const {
        return running() && result_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    }
    /// The result of the work, once. Throws what the work has thrown.
    Result take() { return result_.get(); }

  private:
    std::future<Result> result_;
    std::jthread thread_;
};

/// Work on a thread of its own, of which only the last request matters.
template <class Request, class Result>
class Latest {
  public:
    /// Starts a thread that calls make for the newest request. make never throws. The thread calls on_news after result() has changed.
    Latest(std::function<Result(const Request&)> make, std::function<void()> on_news)
        : make_(std::move(make)),
          on_news_(std::move(on_news)),
          thread_([this](const std::stop_token& stop) { work(stop); }) {}

    /// Replaces a request that is waiting.
    void ask(Request request) {
        const std::lock_guard lock(mutex_);
        waiting_ = std::move(request);
        wake_.notify_one();
    }
    /// The last result, or null.
    std::shared_ptr<const Result> result() const {
        const std::lock_guard lock(mutex_);
        return result_;
    }

  private:
    void work(const std::stop_token& stop) {
        for (;;) {
            std::optional<Request> request;
            {
                std::unique_lock lock(mutex_);
                wake_.wait(lock, stop, [this] { return waiting_.has_value(); });
                if (stop.stop_requested()) return;
                request = std::exchange(waiting_, std::nullopt);
            }
            auto made = std::make_shared<const Result>(make_(*request));
            {
                const std::lock_guard lock(mutex_);
                result_ = std::move(made);
            }
            on_news_();
        }
    }

    std::function<Result(const Request&)> make_;
    std::function<void()> on_news_;
    mutable std::mutex mutex_;
    std::condition_variable_any wake_;
    std::optional<Request> waiting_;
    std::shared_ptr<const Result> result_;
    std::jthread thread_;
};

}  // namespace ewa::viewer
