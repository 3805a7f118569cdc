// SPDX-License-Identifier: Apache-2.0
#include "ranks/network.h"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <functional>

namespace ewa::ranks {
namespace {

using Clock = std::chrono::steady_clock;

double median(std::vector<double> values) {
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/// The milliseconds of each run, those of the slowest rank. All ranks begin a run together.
std::vector<double> time_runs(Ranks& ranks, size_t runs, const std::function<void()>& run) {
    std::vector<uint64_t> own;
    for (size_t i = 0; i < runs; ++i) {
        ranks.gather(std::array<uint64_t, 1>{});
        const auto begin = Clock::now();
        run();
        const std::chrono::duration<double, std::milli> took = Clock::now() - begin;
        own.push_back(std::bit_cast<uint64_t>(took.count()));
    }
    const std::vector<uint64_t> all = ranks.gather(own);
    std::vector<double> slowest(runs);
    for (size_t i = 0; i < all.size(); ++i)
        slowest[i % runs] = std::max(slowest[i % runs], std::bit_cast<double>(all[i]));
    return slowest;
}

Transfer time_transfer(Ranks& ranks, uint64_t bytes) {
    const size_t size = size_t(ranks.size()), others = std::max<size_t>(1, size - 1), part = bytes / others;
    std::vector<std::byte> sent(part * others, std::byte{1}), received(part * others);
    std::vector<std::span<const std::byte>> out(size);
    std::vector<std::span<std::byte>> in(size);
    for (size_t r = 0, at = 0; r < size; ++r) {
        if (int(r) == ranks.rank() && size > 1) continue;
        out[r] = std::span(sent).subspan(at, part);
        in[r] = std::span(received).subspan(at, part);
        at += part;
    }
    const auto run = [&] { ranks.exchange(out, in); };
    // The first runs connect the ranks. All ranks see the same times, so they agree on the number of runs.
    constexpr double kEnoughMs = 300;
    const double one = median(time_runs(ranks, 3, run));
    const size_t runs = size_t(std::clamp(kEnoughMs / std::max(one, 1e-3), 5.0, 200.0));
    return {part * others, median(time_runs(ranks, runs, run))};
}

}  // namespace

Network measure_network(Ranks& ranks, const std::vector<uint64_t>& sizes) {
    constexpr size_t kGathers = 1000;
    Network network{ranks.size(), 0, {}};
    const uint64_t own[] = {uint64_t(ranks.rank())};
    network.gather_ms = median(time_runs(ranks, kGathers, [&] { ranks.gather(own); }));
    for (const uint64_t bytes : sizes) network.transfers.push_back(time_transfer(ranks, bytes));
    return network;
}

}  // namespace ewa::ranks
