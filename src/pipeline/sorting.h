// SPDX-License-Identifier: Apache-2.0
// The device-wide building blocks of a frame: prefix sum, and stable radix sort of (key, value) pairs.
#pragma once
#include "gpu/recording.h"
#include "pipeline/kernels.h"
#include "pipeline/sizes.h"

namespace ewa::pipeline {

struct ScanBuffers {
    const gpu::Buffer& source;  // items
    const gpu::Buffer* order;   // where given, entry e is source[order[e]]
    const gpu::Buffer& prefix;  // items: sum of the entries before, within the block
    const gpu::Buffer& totals;  // blocks + 1: sum of the blocks before; the grand total last
    const gpu::Buffer& counts;  // Counts
};
enum class Total : uint32_t { none = 0, instances = 1, densified = 2 };

/// Exclusive prefix sum of entry e: totals[e / block] + prefix[e]. total: which of Counts receives the grand
/// total.
void record_scan(gpu::Recording& recording, Kernels& kernels, const ScanBuffers& buffers, uint32_t items,
                 uint32_t block, Total total, const char* name);

struct SortBuffers {
    const gpu::Buffer* keys[2];    // keys[0] holds the input
    const gpu::Buffer* values[2];  // values[0] holds the input, unless own_numbers
    const gpu::Buffer* places[2];  // scratch and result: where each item went. nullptr: nobody asks
    bool own_numbers;              // the values are the items' own numbers
    const gpu::Buffer& counters;
    const gpu::Buffer& counter_prefix;
    const gpu::Buffer& digit_totals;
    const gpu::Buffer& counts;
};

/// Stable sort of `items` pairs (0: Counts.instances of them, none where that exceeds `capacity`) by the low
/// cut.passes * cut.bits bits. Returns the index i of values[i] and places[i] with the result; keys_sorted:
/// keep the sorted keys too, in keys[i].
uint32_t record_sort(gpu::Recording& recording, Kernels& kernels, const SortBuffers& buffers,
                     const RadixCut& cut, uint32_t items, uint32_t capacity, bool keys_sorted,
                     const char* name);

}  // namespace ewa::pipeline
