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

/// Calls work() `runs` times; runs 0: as often as fits in about a second, at least 5 and at most 25 times.
void repeat(int runs, const std::function<void()>& work);

/// Wall time of each call in milliseconds, after one that does not count.
Spread time_repeated(int runs, const std::function<void()>& work);

/// Of the whole process, all threads, in milliseconds.
double process_cpu_milliseconds();
double wall_milliseconds();

}  // namespace ewa::bench
