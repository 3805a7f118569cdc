// SPDX-License-Identifier: Apache-2.0
// Several timings of one thing, as a median and how far they lie from it.
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

/// 1.4826 MAD / median: the relative standard deviation, where the timings are normally distributed.
double relative_noise(const Spread& spread);

/// Both in milliseconds. cpu: processor time of all of the process's threads divided by the number of the
/// host's threads, which is the wall time that the same work takes when nothing else runs and every thread
/// has an equal share of it. On a busy machine it repeats to a few per cent where wall time does not.
struct Timed {
    Spread wall, cpu;
};

unsigned host_threads();

/// Calls work() `runs` times; runs 0: as often as fits in about a second, at least 5 and at most 25 times.
void repeat(int runs, const std::function<void()>& work);

/// Of each call, after one that does not count.
Timed time_repeated(int runs, const std::function<void()>& work);

/// Times one thing after the other.
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
