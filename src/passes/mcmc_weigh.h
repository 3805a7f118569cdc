// SPDX-License-Identifier: Apache-2.0
// Weights of the splats as sources of others, and which are dead.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct McmcWeigh {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& params;
        const gpu::Buffer& weights;
        const gpu::Buffer& dead;
    };

    McmcWeigh(gpu::Device& device, const Shape& shape)
        : pipeline(device, "mcmc_weigh", shader_code("mcmc_weigh"),
                   {spec(shared::SPEC_GROUP_SIZE, shape.group)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::McmcPush& push) const {
        recording.dispatch(
            pipeline, "mcmc_weigh",
            {gpu::reads(0, buffers.params), gpu::writes(1, buffers.weights), gpu::writes(2, buffers.dead)},
            push, element_groups(shape, push.splats));
    }
};

}  // namespace ewa::passes
