// SPDX-License-Identifier: Apache-2.0
#include "bench/spread.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <thread>

namespace ewa::bench {
namespace {

/// Linear between the sorted values.
double quantile(const std::vector<double>& sorted, double q) {
    const double at = q * double(sorted.size() - 1);
    const size_t below = size_t(at), above = std::min(below + 1, sorted.size() - 1);
    return sorted[below] + (at - double(below)) * (sorted[above] - sorted[below]);
}

double wall_milliseconds() {
    using namespace std::chrono;
    return duration<double, std::milli>(steady_clock::now().time_since_epoch()).count();
}

double cpu_milliseconds_a_thread() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double(now.tv_sec) * 1e3 + double(now.tv_nsec) * 1e-6) / host_threads();
}

constexpr int kFewest = 5, kMost = 25;
constexpr double kBudgetMilliseconds = 1000;

}  // namespace

Spread spread_of(std::vector<double> samples) {
    Spread spread;
    spread.samples = int(samples.size());
    if (samples.empty()) return spread;
    std::sort(samples.begin(), samples.end());
    spread.median = quantile(samples, 0.5);
    spread.low = quantile(samples, 0.25);
    spread.high = quantile(samples, 0.75);
    spread.least = samples.front();
    for (double& sample : samples) sample = std::abs(sample - spread.median);
    std::sort(samples.begin(), samples.end());
    spread.mad = quantile(samples, 0.5);
    return spread;
}

double relative_noise(const Spread& spread) {
    return spread.median > 0 ? 1.4826 * spread.mad / spread.median : 0;
}

void repeat(int runs, const std::function<void()>& work) {
    const double start = wall_milliseconds();
    for (int run = 0;; ++run) {
        if (runs > 0 && run >= runs) return;
        if (runs == 0 && run >= kMost) return;
        if (runs == 0 && run >= kFewest && wall_milliseconds() - start > kBudgetMilliseconds) return;
        work();
    }
}

Timed time_repeated(int runs, const std::function<void()>& work) {
    work();
    Stopwatch watch;
    repeat(runs, [&] {
        watch.start();
        work();
        watch.stop();
    });
    return watch.timed();
}

unsigned host_threads() {
    return std::max(1u, std::thread::hardware_concurrency());
}

void Stopwatch::start() {
    wall_start_ = wall_milliseconds();
    cpu_start_ = cpu_milliseconds_a_thread();
}

void Stopwatch::stop() {
    wall_.push_back(wall_milliseconds() - wall_start_);
    cpu_.push_back(cpu_milliseconds_a_thread() - cpu_start_);
}

}  // namespace ewa::bench
