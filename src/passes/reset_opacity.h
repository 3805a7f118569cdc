// SPDX-License-Identifier: Apache-2.0
// Lowers every opacity and forgets its moments.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct ResetOpacity {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& params;
        const gpu::Buffer& moments1;
        const gpu::Buffer& moments2;
    };

    ResetOpacity(gpu::Device& device, const Shape& shape)
        : pipeline(device, "reset_opacity", shader_code("reset_opacity"),
                   {spec(shared::SPEC_GROUP_SIZE, shape.group)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::ResetPush& push) const {
        recording.dispatch(pipeline, "reset_opacity",
                           {gpu::updates(0, buffers.params), gpu::updates(1, buffers.moments1),
                            gpu::updates(2, buffers.moments2)},
                           push, element_groups(shape, push.splats));
    }
};

}  // namespace ewa::passes
