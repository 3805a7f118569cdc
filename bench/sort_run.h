// SPDX-License-Identifier: Apache-2.0
// The device's radix sort by itself.
#pragma once
#include <memory>

#include "bench/result.h"
#include "gpu/executor.h"
#include "pipeline/sorting.h"

namespace ewa::bench {

/// Random 32-bit keys, each with its number as its value.
class SortRun {
  public:
    SortRun(std::shared_ptr<gpu::Device> device, uint32_t items);

    /// Copies the input and sorts the copy.
    void run();
    const pipeline::RadixCut& cut() const { return cut_; }
    const std::vector<gpu::Timing>& timings() const { return executor_.timings(); }
    /// Against a stable sort on the host.
    Check check() const;

  private:
    std::shared_ptr<gpu::Device> device_;
    passes::PassCache cache_;
    gpu::Executor executor_;
    pipeline::RadixCut cut_;
    uint32_t items_;
    std::vector<uint32_t> input_;
    gpu::Buffer source_, keys_[2], values_[2], counters_, counter_prefix_, digit_totals_, counts_;
    uint32_t result_ = 0;
};

}  // namespace ewa::bench
