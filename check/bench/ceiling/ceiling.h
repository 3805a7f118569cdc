// SPDX-License-Identifier: Apache-2.0
// The work of some passes in plain C++ on the host's cores. The benchmark compares the time of passes with its time.
#pragma once
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bench/ceiling/blend_loop.h"
#include "bench/statistics.h"

namespace ewa::bench {

/// The instructions that the loops use on this CPU: "AVX-512 and FMA", "AVX2 and FMA" or "portable".
std::string vector_text();

/// Runs work(index) on that many threads, including the caller's, and waits for all.
void on_threads(unsigned threads, const std::function<void(unsigned)>& work);

/// Calls visit(index) for each index below `count`. All threads take the next indices when they are free.
template <class Visit>
void for_all(uint32_t count, Visit visit) {
    constexpr uint32_t kAtOnce = 16;
    std::atomic<uint32_t> next{0};
    on_threads(host_threads(), [&](unsigned) {
        for (uint32_t begin; (begin = next.fetch_add(kAtOnce)) < count;)
            for (uint32_t i = begin; i < std::min(begin + kAtOnce, count); ++i) visit(i);
    });
}

/// Blends a whole image on all threads. planes: 4 * width * height floats.
Timed time_blend(const BlendLists& lists, uint32_t tiles, int runs, std::vector<float>& planes);
PairCounts count_pairs(const BlendLists& lists, uint32_t tiles);

/// A stable radix sort of pairs (32-bit key, 32-bit value) by the low bits of random keys, on all threads:
/// least significant digit first, digits of at most 11 bits.
Timed time_sort(uint32_t items, uint32_t bits, int runs);
/// The timed sort, for its test. Sorts keys and values in place.
void sort_pairs(std::vector<uint32_t>& keys, std::vector<uint32_t>& values, uint32_t bits);

/// The best rate of copying between blocks beyond the caches' size: bytes read and written, GB/s.
struct Bandwidth {
    double wall = 0, cpu = 0;  // see Timed
};
Bandwidth copy_bandwidth();

}  // namespace ewa::bench
