// SPDX-License-Identifier: Apache-2.0
// The picture through a photograph's exposure.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct Expose {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& image;
        const gpu::Buffer& exposures;
        const gpu::Buffer& exposed;
    };

    Expose(gpu::Device& device, const Shape& shape)
        : pipeline(device, "expose", shader_code("expose"), {spec(shared::SPEC_GROUP_SIZE, shape.group)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::ExposurePush& push) const {
        recording.dispatch(
            pipeline, "expose",
            {gpu::reads(0, buffers.image), gpu::reads(1, buffers.exposures), gpu::writes(2, buffers.exposed)},
            push, element_groups(shape, uint64_t(push.size[0]) * push.size[1]));
    }
};

}  // namespace ewa::passes
