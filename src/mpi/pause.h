// SPDX-License-Identifier: Apache-2.0
// Waiting between two looks at messages, which must not take the cores that other ranks work with.
#pragma once
#include <sched.h>

#include <algorithm>
#include <chrono>
#include <thread>

namespace ewa::mpi {

class Pause {
  public:
    using Clock = std::chrono::steady_clock;

    /// crowded: this machine has more ranks than cores, so the one that must answer may wait for this core.
    explicit Pause(bool crowded) : crowded_(crowded) {}

    /// all_here: the other ranks have come to this exchange, and data flow. MPI moves them while it is
    /// called. Else it sleeps, for a tenth of the time that it has waited.
    void wait(bool all_here) {
        const Clock::duration time = waited();
        if (time > (all_here ? kFlowing : crowded_ ? kYielding : kLooking))
            std::this_thread::sleep_for(std::min<Clock::duration>(time / 10, kLongestSleep));
        else if (crowded_)
            sched_yield();
    }
    Clock::duration waited() const { return Clock::now() - begin_; }

  private:
    static constexpr std::chrono::microseconds kLooking{50}, kYielding{1000}, kFlowing{1000000},
        kLongestSleep{500};
    bool crowded_;
    Clock::time_point begin_ = Clock::now();
};

}  // namespace ewa::mpi
