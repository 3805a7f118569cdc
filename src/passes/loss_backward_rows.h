// SPDX-License-Identifier: Apache-2.0
// Gradient of the whole loss by the rendering.
#pragma once
#include "gpu/recording.h"
#include "passes/loss_items.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct LossBackwardRows {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& blurred;
        const gpu::Buffer& image;
        const gpu::Buffer& target;
        const gpu::Buffer& image_gradient;
        const gpu::Buffer& partials;
    };

    LossBackwardRows(gpu::Device& device, const Shape& shape)
        : pipeline(
              device, "loss_backward_rows", shader_code("loss_backward_rows"),
              {spec(shared::SPEC_GROUP_SIZE, shape.group), spec(shared::SPEC_SUBGROUP, shape.subgroup)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::LossPush& push) const {
        recording.dispatch(
            pipeline, "loss_backward_rows",
            {gpu::reads(0, buffers.blurred), gpu::reads(1, buffers.image), gpu::reads(2, buffers.target),
             gpu::writes(3, buffers.image_gradient), gpu::writes(4, buffers.partials)},
            push, element_groups(shape, loss_row_items(push.stride, push.size[1]), 3));
    }
};

}  // namespace ewa::passes
