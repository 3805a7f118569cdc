// SPDX-License-Identifier: Apache-2.0
// What the host's cores do with the same work in plain C++: the ceiling that passes are held against.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bench/ceiling/blend_loop.h"
#include "bench/spread.h"

namespace ewa::bench {

/// "AVX-512 and FMA", "AVX2 and FMA" or "portable": what the loops use on this CPU.
std::string vector_text();

/// work(number) on that many threads, the caller's among them; returns when all are done.
void on_threads(unsigned threads, const std::function<void(unsigned)>& work);

/// A whole picture on all threads. planes: 4 * width * height floats.
Timed time_blend(const BlendLists& lists, uint32_t tiles, int runs, std::vector<float>& planes);
PairCounts count_pairs(const BlendLists& lists, uint32_t tiles);

/// A stable sort of (32-bit key, 32-bit value) pairs by the low bits of random keys: least
/// significant digit first, digits of at most 11 bits, all threads.
Timed time_sort(uint32_t items, uint32_t bits, int runs);
/// The sort that is timed, for its test. Result in keys and values.
void sort_pairs(std::vector<uint32_t>& keys, std::vector<uint32_t>& values, uint32_t bits);

/// Gigabytes (1e9) a second read and written by copying between blocks far larger than the caches, at best.
struct Bandwidth {
    double wall = 0, cpu = 0;  // see Timed
};
Bandwidth copy_bandwidth();

}  // namespace ewa::bench
