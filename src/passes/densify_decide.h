// SPDX-License-Identifier: Apache-2.0
// How many splats each splat becomes.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct DensifyDecide {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& params;
        const gpu::Buffer& statistics;
        const gpu::Buffer& outputs;
    };

    DensifyDecide(gpu::Device& device, const Shape& shape)
        : pipeline(device, "densify_decide", shader_code("densify_decide"),
                   {spec(shared::SPEC_GROUP_SIZE, shape.group)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::DensifyPush& push) const {
        recording.dispatch(pipeline, "densify_decide",
                           {gpu::reads(0, buffers.params), gpu::reads(1, buffers.statistics),
                            gpu::writes(2, buffers.outputs)},
                           push, element_groups(shape, push.splats));
    }
};

}  // namespace ewa::passes
