// SPDX-License-Identifier: Apache-2.0
// Counts the digits of one radix pass; the counters stand at zero before.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct RadixCount {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& keys;
        const gpu::Buffer& counters;
        const gpu::Buffer& counts;
    };

    RadixCount(gpu::Device& device, const Shape& shape, uint32_t bits)
        : pipeline(device, "radix_count", shader_code("radix_count"),
                   {spec(shared::SPEC_GROUP_SIZE, shape.sort_group), spec(shared::SPEC_RADIX_BITS, bits)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::SortPush& push, const char* name) const {
        recording.dispatch(
            pipeline, name,
            {gpu::reads(0, buffers.keys), gpu::updates(1, buffers.counters), gpu::reads(2, buffers.counts)},
            push, {(push.lanes + shape.sort_group - 1) / shape.sort_group, 1, 1});
    }
};

}  // namespace ewa::passes
