// SPDX-License-Identifier: Apache-2.0
#include "bench/statistics.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <map>
#include <thread>

#include "bench/result.h"

namespace ewa::bench {
namespace {

/// Interpolates linearly between the sorted values.
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

/// Logarithms of a number and of the time that it takes.
struct Point {
    double x = 0, y = 0;
};

Scaling fit(const std::string& of, const std::string& against, const std::vector<Point>& points) {
    const double n = double(points.size());
    double mx = 0, my = 0, xx = 0, xy = 0;
    for (const Point& p : points) {
        mx += p.x / n;
        my += p.y / n;
    }
    for (const Point& p : points) {
        xx += (p.x - mx) * (p.x - mx);
        xy += (p.x - mx) * (p.y - my);
    }
    Scaling scaling{of, against, xy / xx, 0, int(n)};
    for (const Point& p : points)
        scaling.residual += std::pow(p.y - my - scaling.exponent * (p.x - mx), 2) / n;
    scaling.residual = std::sqrt(scaling.residual);
    return scaling;
}

/// The name of a case without its number of splats, which is the same for all cases of a fit.
std::string series_of(const Case& one) {
    const size_t begin = one.name.find('_'), end = one.name.find('_', begin + 1);
    return one.name.substr(0, begin) + one.name.substr(end);
}

constexpr size_t kFewestPoints = 3;        // of a fit
constexpr uint32_t kFewestSplats = 10000;  // a smaller frame costs as much as its dispatches

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

void repeat_for(double milliseconds, const std::function<void()>& work) {
    const double start = wall_milliseconds();
    while (wall_milliseconds() - start < milliseconds) work();
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

std::vector<Scaling> fit_scaling(const std::vector<CaseResult>& cases) {
    std::map<std::string, std::vector<Point>> by_splats;
    std::vector<Point> by_pairs;
    for (const CaseResult& c : cases) {
        const bool frame = c.one.kind == Kind::forward || c.one.kind == Kind::train;
        // CPU time, if known, is independent of the other work of the machine.
        const double time = c.total.cpu.samples > 0 ? c.total.cpu.median : c.total.wall.median;
        if (!frame || c.one.splats < kFewestSplats || !(time > 0)) continue;
        by_splats[series_of(c.one)].push_back({std::log(double(c.one.splats)), std::log(time)});
        if (c.one.kind == Kind::forward && c.pairs_evaluated > 0)
            by_pairs.push_back({std::log(double(c.pairs_evaluated)), std::log(time)});
    }
    std::vector<Scaling> scaling;
    for (const auto& [name, points] : by_splats)
        if (points.size() >= kFewestPoints) scaling.push_back(fit(name, "splats", points));
    if (by_pairs.size() >= kFewestPoints)
        scaling.push_back(fit("all forward cases", "pairs evaluated", by_pairs));
    return scaling;
}

}  // namespace ewa::bench
