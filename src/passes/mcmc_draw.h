// SPDX-License-Identifier: Apache-2.0
// Draws sources by their weights, and counts how often each was drawn.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct McmcDraw {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& prefix;
        const gpu::Buffer& totals;
        const gpu::Buffer& sources;
        const gpu::Buffer& hits;
    };

    McmcDraw(gpu::Device& device, const Shape& shape)
        : pipeline(device, "mcmc_draw", shader_code("mcmc_draw"),
                   {spec(shared::SPEC_GROUP_SIZE, shape.group)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::McmcPush& push) const {
        recording.dispatch(pipeline, "mcmc_draw",
                           {gpu::reads(0, buffers.prefix), gpu::reads(1, buffers.totals),
                            gpu::writes(2, buffers.sources), gpu::updates(3, buffers.hits)},
                           push, element_groups(shape, push.draws));
    }
};

}  // namespace ewa::passes
