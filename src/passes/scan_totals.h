// SPDX-License-Identifier: Apache-2.0
// Exclusive prefix sum of the blocks' totals, in place, with the grand total behind them.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct ScanTotals {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& totals;
        const gpu::Buffer& counts;
    };

    ScanTotals(gpu::Device& device, const Shape& shape)
        : pipeline(
              device, "scan_totals", shader_code("scan_totals"),
              {spec(shared::SPEC_GROUP_SIZE, shape.subgroup), spec(shared::SPEC_SUBGROUP, shape.subgroup)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::ScanTotalsPush& push, const char* name) const {
        recording.dispatch(pipeline, name, {gpu::updates(0, buffers.totals), gpu::writes(1, buffers.counts)},
                           push, subgroup_groups(shape, 1));
    }
};

}  // namespace ewa::passes
