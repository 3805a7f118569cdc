// SPDX-License-Identifier: Apache-2.0
// Moves the pairs of one radix pass to their places. mode: see the shader.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct RadixScatter {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& keys;
        const gpu::Buffer& values;
        const gpu::Buffer& numbers;
        const gpu::Buffer& counters;
        const gpu::Buffer& bases;
        const gpu::Buffer& counts;
        const gpu::Buffer& keys_out;
        const gpu::Buffer& values_out;
        const gpu::Buffer& numbers_out;
    };

    RadixScatter(gpu::Device& device, const Shape& shape, uint32_t bits, uint32_t mode)
        : pipeline(device, "radix_scatter", shader_code("radix_scatter"),
                   {spec(shared::SPEC_GROUP_SIZE, shape.sort_group), spec(shared::SPEC_RADIX_BITS, bits),
                    spec(shared::SPEC_MODE, mode)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::SortPush& push, const char* name) const {
        recording.dispatch(
            pipeline, name,
            {gpu::reads(0, buffers.keys), gpu::reads(1, buffers.values), gpu::updates(2, buffers.counters),
             gpu::reads(3, buffers.bases), gpu::reads(4, buffers.counts), gpu::writes(5, buffers.keys_out),
             gpu::writes(6, buffers.values_out), gpu::reads(7, buffers.numbers),
             gpu::writes(8, buffers.numbers_out)},
            push, {(push.lanes + shape.sort_group - 1) / shape.sort_group, 1, 1});
    }
};

}  // namespace ewa::passes
