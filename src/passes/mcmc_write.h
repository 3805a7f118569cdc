// SPDX-License-Identifier: Apache-2.0
// Writes the next generation of splats: the dead relocated, new ones added.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct McmcWrite {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& params;
        const gpu::Buffer& moments1;
        const gpu::Buffer& moments2;
        const gpu::Buffer& dead;
        const gpu::Buffer& prefix;
        const gpu::Buffer& totals;
        const gpu::Buffer& sources;
        const gpu::Buffer& hits;
        const gpu::Buffer& params_out;
        const gpu::Buffer& moments1_out;
        const gpu::Buffer& moments2_out;
    };

    McmcWrite(gpu::Device& device, const Shape& shape, uint32_t stored_degree)
        : pipeline(
              device, "mcmc_write", shader_code("mcmc_write"),
              {spec(shared::SPEC_GROUP_SIZE, shape.group), spec(shared::SPEC_SH_DEGREE, stored_degree)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::McmcPush& push) const {
        recording.dispatch(
            pipeline, "mcmc_write",
            {gpu::reads(0, buffers.params), gpu::reads(1, buffers.moments1), gpu::reads(2, buffers.moments2),
             gpu::reads(3, buffers.dead), gpu::reads(4, buffers.prefix), gpu::reads(5, buffers.totals),
             gpu::reads(6, buffers.sources), gpu::reads(7, buffers.hits), gpu::writes(8, buffers.params_out),
             gpu::writes(9, buffers.moments1_out), gpu::writes(10, buffers.moments2_out)},
            push, element_groups(shape, push.new_splats));
    }
};

}  // namespace ewa::passes
