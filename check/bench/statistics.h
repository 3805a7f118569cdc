// SPDX-License-Identifier: Apache-2.0
// Repeated timings of one piece of work: median and spread.
#pragma once
#include <functional>
#include <vector>

namespace ewa::bench {

struct Spread {
    double median = 0;
    double mad = 0;            // median absolute deviation from the median
    double low = 0, high = 0;  // quartiles
    double least = 0;
    int samples = 0;
};

Spread spread_of(std::vector<double> samples);

/// 1.4826 MAD / median: the relative standard deviation of normally distributed timings.
double relative_noise(const Spread& spread);

/// Milliseconds. cpu: the CPU time of all threads of the process divided by the number of host threads. This
/// is the wall time of the same work on an idle machine whose threads share it equally. On a busy machine it
/// varies by a few per cent, while wall time varies much more.
struct Timed {
    Spread wall, cpu;
};

unsigned host_threads();

/// Calls work() `runs` times. runs 0: for about a second, at least 5 and at most 25 times.
void repeat(int runs, const std::function<void()>& work);

/// Calls work() again and again until so much wall time has passed.
void repeat_for(double milliseconds, const std::function<void()>& work);

/// Times each call, after one that does not count.
Timed time_repeated(int runs, const std::function<void()>& work);

/// Collects the times between start() and stop().
class Stopwatch {
  public:
    void start();
    void stop();
    Timed timed() const { return {spread_of(wall_), spread_of(cpu_)}; }

  private:
    double wall_start_ = 0, cpu_start_ = 0;
    std::vector<double> wall_, cpu_;
};

}  // namespace ewa::bench
