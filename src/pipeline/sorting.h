// SPDX-License-Identifier: Apache-2.0
// The device-wide building blocks of a frame: prefix sum, and stable radix sort of (key, value) pairs.
#pragma once
#include "pipeline/frame_buffers.h"

namespace ewa::pipeline {

struct ScanBuffers {
    const gpu::Buffer& source;  // items
    const gpu::Buffer* order;   // null: entry e is source[e]; else source[order[e]]
    const gpu::Buffer& prefix;  // items: sum of the entries before, within the block
    const gpu::Buffer& totals;  // blocks + 1: sum of the blocks before; the grand total last
    const gpu::Buffer& counts;  // Counts
};
struct ScanWork {
    uint32_t items;
    uint32_t block;           // number of entries that a subgroup scans
    uint32_t total;           // shared::TOTAL_*: which of Counts receives the grand total
    const char* name;         // of the timing
    uint32_t capacity = ~0u;  // of instances, with TOTAL_INSTANCES
    bool flags = false;       // counts the entries that are not 0
    bool live = false;        // a block ends after Counts.sort_blocks entries
};

/// Records an exclusive prefix sum. The sum before entry e is totals[e / block] + prefix[e].
void record_scan(const passes::Recorder& on, const ScanBuffers& buffers, const ScanWork& work);

struct SortBuffers {
    const gpu::Buffer* keys[2];     // keys[0] holds the input
    const gpu::Buffer* values[2];   // values[0] holds the input, unless own_indices
    const gpu::Buffer* indices[2];  // scratch and result: each item's sorted index; nullptr: not wanted
    bool own_indices;               // the values are the items' own indices
    const gpu::Buffer& counters;
    const gpu::Buffer& counter_prefix;
    const gpu::Buffer& digit_totals;
    const gpu::Buffer& counts;
};
struct SortWork {
    RadixCut cut;
    uint32_t items;     // 0: Counts.instances, or none if that exceeds `capacity`
    uint32_t capacity;  // of the buffers
    bool keep_keys;     // also returns the sorted keys
    const char* name;   // of the timing
    bool live = false;  // the last scan with TOTAL_INSTANCES has counted the items, and the workgroups
};

/// Records a stable sort of pairs by the low cut.passes * cut.bits bits of the key. Returns i such that values[i], indices[i] and,
/// with keep_keys, keys[i] hold the result.
uint32_t record_sort(const passes::Recorder& on, const SortBuffers& buffers, const SortWork& work);

}  // namespace ewa::pipeline
