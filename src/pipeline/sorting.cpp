// SPDX-License-Identifier: Apache-2.0
#include "pipeline/sorting.h"

namespace ewa::pipeline {

void record_scan(gpu::Recording& recording, Kernels& kernels, const ScanBuffers& buffers, uint32_t items,
                 uint32_t block, Total total, const char* name) {
    const passes::Shape& shape = kernels.shape();
    const gpu::Buffer& order = buffers.order ? *buffers.order : buffers.source;
    kernels.get<passes::ScanBlocks>(buffers.order != nullptr)
        .record(recording, shape, {buffers.source, order, buffers.prefix, buffers.totals}, {items, block},
                name);
    const uint32_t blocks = uint32_t((uint64_t(items) + block - 1) / block);
    kernels.get<passes::ScanTotals>().record(recording, shape, {buffers.totals, buffers.counts},
                                             {blocks, uint32_t(total)}, name);
}

uint32_t record_sort(gpu::Recording& recording, Kernels& kernels, const SortBuffers& buffers,
                     const RadixCut& cut, uint32_t items, uint32_t capacity, bool keys_sorted,
                     const char* name) {
    const passes::Shape& shape = kernels.shape();
    const uint32_t counters = cut.lanes << cut.bits;
    uint32_t from = 0;  // which keys and values hold the input of the pass
    for (uint32_t pass = 0; pass < cut.passes; ++pass, from ^= 1) {
        const bool first = pass == 0, last = pass + 1 == cut.passes;
        const bool numbered = buffers.places[0] != nullptr;
        const uint32_t mode = (first && buffers.own_numbers ? 1u : 0u) | (last && !keys_sorted ? 2u : 0u) |
                              (numbered ? 4u | (first ? 8u : 0u) | (last ? 16u : 0u) : 0u);
        const shared::SortPush push{items, capacity, cut.lanes, pass * cut.bits};
        const gpu::Buffer& keys = *buffers.keys[from];
        const gpu::Buffer& values = mode & 1u ? keys : *buffers.values[from];
        // What a mode leaves alone stands in for itself.
        const gpu::Buffer& numbers = numbered && !first ? *buffers.places[from] : values;
        const gpu::Buffer& values_out = *buffers.values[from ^ 1];
        recording.fill(buffers.counters, 0, 0, uint64_t(counters) * 4);
        kernels.get<passes::RadixCount>(cut.bits).record(
            recording, shape, {keys, buffers.counters, buffers.counts}, push, name);
        record_scan(recording, kernels,
                    {buffers.counters, nullptr, buffers.counter_prefix, buffers.digit_totals, buffers.counts},
                    counters, cut.lanes, Total::none, name);
        kernels.get<passes::RadixScatter>(cut.bits, mode)
            .record(recording, shape,
                    {keys, values, numbers, buffers.counter_prefix, buffers.digit_totals, buffers.counts,
                     *buffers.keys[from ^ 1], values_out, numbered ? *buffers.places[from ^ 1] : values_out},
                    push, name);
    }
    return from;
}

}  // namespace ewa::pipeline
