// SPDX-License-Identifier: Apache-2.0
// Writes the next generation of splats.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct DensifyWrite {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& params;
        const gpu::Buffer& moments1;
        const gpu::Buffer& moments2;
        const gpu::Buffer& statistics;
        const gpu::Buffer& prefix;
        const gpu::Buffer& totals;
        const gpu::Buffer& params_out;
        const gpu::Buffer& moments1_out;
        const gpu::Buffer& moments2_out;
    };

    DensifyWrite(gpu::Device& device, const Shape& shape, uint32_t stored_degree)
        : pipeline(
              device, "densify_write", shader_code("densify_write"),
              {spec(shared::SPEC_GROUP_SIZE, shape.group), spec(shared::SPEC_SH_DEGREE, stored_degree)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::DensifyPush& push) const {
        recording.dispatch(
            pipeline, "densify_write",
            {gpu::reads(0, buffers.params), gpu::reads(1, buffers.moments1), gpu::reads(2, buffers.moments2),
             gpu::reads(3, buffers.statistics), gpu::reads(4, buffers.prefix), gpu::reads(5, buffers.totals),
             gpu::writes(6, buffers.params_out), gpu::writes(7, buffers.moments1_out),
             gpu::writes(8, buffers.moments2_out)},
            push, element_groups(shape, push.splats));
    }
};

}  // namespace ewa::passes
