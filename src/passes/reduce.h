// SPDX-License-Identifier: Apache-2.0
// Adds up floats in a fixed order.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct Reduce {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& source;
        const gpu::Buffer& sums;
        const gpu::Buffer& counts;
    };

    Reduce(gpu::Device& device, const Shape& shape)
        : pipeline(
              device, "reduce", shader_code("reduce"),
              {spec(shared::SPEC_GROUP_SIZE, shape.subgroup), spec(shared::SPEC_SUBGROUP, shape.subgroup)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::ReducePush& push) const {
        recording.dispatch(
            pipeline, "reduce",
            {gpu::reads(0, buffers.source), gpu::writes(1, buffers.sums), gpu::writes(2, buffers.counts)},
            push, subgroup_groups(shape, (uint64_t(push.items) + push.block - 1) / push.block));
    }
};

}  // namespace ewa::passes
