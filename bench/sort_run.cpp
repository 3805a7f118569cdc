// SPDX-License-Identifier: Apache-2.0
#include "bench/sort_run.h"

#include "core/random.h"
#include "reference/sort.h"

namespace ewa::bench {

SortRun::SortRun(std::shared_ptr<gpu::Device> device, uint32_t items)
    : device_(std::move(device)), cache_(*device_), executor_(*device_), items_(items), input_(items) {
    pipeline::FrameRequest request;
    request.splats = items;
    request.width = request.height = 8;
    const pipeline::Sizes sizes = pipeline::sizes_for(cache_.config(), request);
    cut_ = sizes.depth_sort;
    for (uint32_t i = 0; i < items; ++i) input_[i] = core::pcg4d({i, 0x736f7274u, 0, 0})[0];
    source_ = gpu::Buffer(*device_, "input", sizes.splat_words);
    source_.upload(std::span<const uint32_t>(input_));
    for (gpu::Buffer* buffer : {&keys_[0], &keys_[1], &values_[0], &values_[1]})
        *buffer = gpu::Buffer(*device_, "pairs", sizes.splat_words, gpu::Texel::rgba32ui);
    counters_ = gpu::Buffer(*device_, "counters", sizes.counters);
    counter_prefix_ = gpu::Buffer(*device_, "counter prefix", sizes.counters);
    digit_totals_ = gpu::Buffer(*device_, "digit totals", sizes.digit_totals);
    counts_ = gpu::Buffer(*device_, "counts", sizeof(shared::Counts), gpu::Texel::none, false, true);
}

void SortRun::run() {
    gpu::Recording recording(device_->limits());
    recording.copy(source_, 0, keys_[0], 0, uint64_t(items_) * 4);
    result_ =
        record_sort(recording, cache_,
                    {.keys = {&keys_[0], &keys_[1]},
                     .values = {&values_[0], &values_[1]},
                     .indices = {},
                     .own_indices = true,
                     .counters = counters_,
                     .counter_prefix = counter_prefix_,
                     .digit_totals = digit_totals_,
                     .counts = counts_},
                    {.cut = cut_, .items = items_, .capacity = items_, .keep_keys = true, .name = "sort"});
    executor_.run(recording, true);
}

Check SortRun::check() const {
    const auto expected = reference::stable_order<uint32_t>(input_);
    const auto keys = keys_[result_].download<uint32_t>(items_),
               values = values_[result_].download<uint32_t>(items_);
    uint64_t wrong = 0;
    for (uint32_t i = 0; i < items_; ++i) wrong += values[i] != expected[i] || keys[i] != input_[expected[i]];
    return {"sort: wrong entries", double(wrong), 0};
}

}  // namespace ewa::bench
