// SPDX-License-Identifier: Apache-2.0
#include "pipeline/sorting.h"

#include <cstddef>
#include <type_traits>

#include "passes/passes.h"

namespace ewa::pipeline {

void record_scan(const passes::Recorder& on, const ScanBuffers& buffers, const ScanWork& work) {
    const passes::KernelConfig& config = on.cache.config();
    const uint32_t mode = buffers.order ? shared::SCAN_GATHERED
                          : work.flags  ? shared::SCAN_FLAGS
                          : work.live   ? shared::SCAN_LIVE
                                        : 0;
    const bool counts_groups = config.live_counts && work.total == shared::TOTAL_INSTANCES;
    on.record(passes::ScanBlocks{.source = buffers.source,
                                 .order = buffers.order ? *buffers.order : buffers.source,
                                 .prefix = buffers.prefix,
                                 .totals = buffers.totals,
                                 .counts = buffers.counts},
              {.items = work.items, .block = work.block}, {{shared::SPEC_MODE, mode}}, work.name);
    const uint32_t blocks = uint32_t((uint64_t(work.items) + work.block - 1) / work.block);
    on.record(passes::ScanTotals{.totals = buffers.totals, .counts = buffers.counts},
              {.blocks = blocks,
               .total = work.total,
               .capacity = work.capacity,
               .sort_keys = counts_groups ? passes::ranked_keys(config) : 0,
               .max_groups = config.max_groups},
              {}, work.name);
}

namespace {

uint32_t scatter_mode(const SortBuffers& buffers, const SortWork& work, bool first, bool last) {
    uint32_t mode = 0;
    if (first && buffers.own_indices) mode |= shared::SORT_OWN_INDICES;
    if (last && !work.keep_keys) mode |= shared::SORT_DROP_KEYS;
    if (!buffers.indices[0]) return mode;
    mode |= shared::SORT_TRACKED;
    if (first) mode |= shared::SORT_FIRST;
    if (last) mode |= shared::SORT_LAST;
    return mode;
}

}  // namespace

uint32_t record_sort(const passes::Recorder& on, const SortBuffers& buffers, const SortWork& work) {
    const RadixCut& cut = work.cut;
    const passes::KernelConfig& config = on.cache.config();
    const bool ranked = config.ranked_sort, tracked = buffers.indices[0] != nullptr;
    // A caller may read the digit totals of a sort in one pass. Idle workgroups of few blocks cost next to nothing.
    const bool few = ranked && cut.passes > 1 && cut.lanes <= config.few_blocks;
    const bool live = work.live && ranked && config.live_counts && !few;
    const uint32_t few_mode = few ? shared::SORT_FEW : 0;
    // A pass with a workgroup for each block of keys.
    const auto record_blocks = [&](const auto& pass, const shared::SortPush& push,
                                   const passes::Constants& variant) {
        using Definition = std::remove_cvref_t<decltype(pass)>;
        const auto groups =
            live ? gpu::Workgroups(gpu::BufferPart(buffers.counts, offsetof(shared::Counts, sort_groups),
                                                   sizeof(shared::Counts::sort_groups)))
                 : Definition::Work::groups(config, push);
        on.cache.get<Definition>(variant).record(on.recording, pass, push, groups, work.name);
    };
    const uint32_t counters = cut.lanes << cut.bits;
    const gpu::SpecConstant bits{shared::SPEC_RADIX_BITS, cut.bits};
    uint32_t from = 0;  // which of the two buffers holds a pass's input
    for (uint32_t pass = 0; pass < cut.passes; ++pass, from ^= 1) {
        const uint32_t to = from ^ 1;
        const bool first = pass == 0, last = pass + 1 == cut.passes;
        const shared::SortPush push{
            .items = work.items, .capacity = work.capacity, .lanes = cut.lanes, .shift = pass * cut.bits};
        const gpu::Buffer& keys = *buffers.keys[from];
        // A binding that a mode does not use gets another binding's buffer.
        const gpu::Buffer& values = first && buffers.own_indices ? keys : *buffers.values[from];
        if (ranked) {
            record_blocks(passes::RadixCountRanked{keys, buffers.counters, buffers.counts}, push,
                          {bits, {shared::SPEC_MODE, few_mode}});
        } else {
            on.recording.fill(buffers.counters, 0, 0, uint64_t(counters) * 4);
            on.record(passes::RadixCount{keys, buffers.counters, buffers.counts}, push, {bits}, work.name);
        }
        if (!few)
            record_scan(on,
                        {.source = buffers.counters,
                         .order = nullptr,
                         .prefix = buffers.counter_prefix,
                         .totals = buffers.digit_totals,
                         .counts = buffers.counts},
                        {.items = counters,
                         .block = cut.lanes,
                         .total = shared::TOTAL_NONE,
                         .name = work.name,
                         .live = live});
        const passes::Constants variant{
            bits, {shared::SPEC_MODE, scatter_mode(buffers, work, first, last) | few_mode}};
        const passes::ScatterBuffers scattered{
            .keys = keys,
            .values = values,
            .counters = few ? buffers.counters : buffers.counter_prefix,
            .bases = buffers.digit_totals,
            .counts = buffers.counts,
            .keys_out = *buffers.keys[to],
            .values_out = *buffers.values[to],
            .indices = tracked && !first ? *buffers.indices[from] : values,
            .indices_out = tracked ? *buffers.indices[to] : *buffers.values[to]};
        if (ranked)
            record_blocks(passes::RadixScatterRanked{scattered}, push, variant);
        else
            on.record(passes::RadixScatter{scattered}, push, variant, work.name);
    }
    return from;
}

}  // namespace ewa::pipeline
