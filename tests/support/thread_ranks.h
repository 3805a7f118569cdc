// SPDX-License-Identifier: Apache-2.0
// Ranks that are threads of one process, so that tests need no launcher.
#pragma once
#include <algorithm>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "ewa/ranks.h"

namespace ewa::test {

/// Where the threads meet. A thread that fails lets the others fail too.
struct Meeting {
    explicit Meeting(int ranks) : size(ranks), words(size_t(ranks)), out(size_t(ranks)) {}

    const int size;
    std::mutex mutex;
    std::condition_variable met;
    int waiting = 0;
    uint64_t round = 0;
    bool failed = false;
    std::vector<std::vector<uint64_t>> words;
    std::vector<std::vector<std::span<const std::byte>>> out;
    uint64_t bytes_sent = 0;  // to other ranks

    void wait() {
        std::unique_lock lock(mutex);
        const uint64_t own = round;
        if (++waiting == size) {
            waiting = 0;
            ++round;
            met.notify_all();
        } else {
            met.wait(lock, [&] { return round != own || failed; });
        }
        if (failed) throw std::runtime_error("another rank failed");
    }
    void fail() {
        const std::lock_guard lock(mutex);
        failed = true;
        met.notify_all();
    }
};

class ThreadRank : public Ranks {
  public:
    ThreadRank(Meeting& meeting, int rank) : meeting_(meeting), rank_(rank) {}
    int rank() const override { return rank_; }
    int size() const override { return meeting_.size; }
    std::string name(int rank) const override { return "rank " + std::to_string(rank); }
    std::vector<uint64_t> gather(std::span<const uint64_t> own) override {
        meeting_.words[size_t(rank_)].assign(own.begin(), own.end());
        meeting_.wait();
        std::vector<uint64_t> all;
        for (const auto& words : meeting_.words) {
            if (words.size() != own.size())
                throw std::logic_error("ranks gather different numbers of values");
            all.insert(all.end(), words.begin(), words.end());
        }
        meeting_.wait();
        return all;
    }
    void exchange(std::span<const std::span<const std::byte>> out,
                  std::span<const std::span<std::byte>> in) override {
        meeting_.out[size_t(rank_)].assign(out.begin(), out.end());
        meeting_.wait();
        for (size_t rank = 0; rank < in.size(); ++rank) {
            const std::span<const std::byte> part = meeting_.out[rank][size_t(rank_)];
            if (part.size() != in[rank].size()) throw std::logic_error("a part has two sizes");
            std::copy(part.begin(), part.end(), in[rank].begin());
            if (rank == size_t(rank_)) continue;
            const std::lock_guard lock(meeting_.mutex);
            meeting_.bytes_sent += part.size();
        }
        meeting_.wait();
    }
    [[noreturn]] void end_all(int) override {
        meeting_.fail();
        throw std::runtime_error("all ranks end");
    }

  private:
    Meeting& meeting_;
    int rank_;
};

/// Calls work(rank) in a thread for each rank. Rethrows what the first rank that failed has thrown.
inline void run_ranks(int ranks, const std::function<void(std::shared_ptr<Ranks>)>& work) {
    Meeting meeting(ranks);
    std::exception_ptr error;
    std::vector<std::thread> threads;
    for (int rank = 0; rank < ranks; ++rank)
        threads.emplace_back([&, rank] {
            try {
                work(std::make_shared<ThreadRank>(meeting, rank));
            } catch (...) {
                {
                    const std::lock_guard lock(meeting.mutex);
                    if (!error && !meeting.failed) error = std::current_exception();
                }
                meeting.fail();
            }
        });
    for (std::thread& thread : threads) thread.join();
    if (error) std::rethrow_exception(error);
}

}  // namespace ewa::test
