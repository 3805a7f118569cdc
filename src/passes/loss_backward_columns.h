// SPDX-License-Identifier: Apache-2.0
// Derivatives of SSIM carried back through the window, down the columns.
#pragma once
#include "gpu/recording.h"
#include "passes/loss_items.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct LossBackwardColumns {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& derivatives;
        const gpu::Buffer& blurred;
    };

    LossBackwardColumns(gpu::Device& device, const Shape& shape)
        : pipeline(device, "loss_backward_columns", shader_code("loss_backward_columns"),
                   {spec(shared::SPEC_GROUP_SIZE, shape.group)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::LossPush& push) const {
        recording.dispatch(pipeline, "loss_backward_columns",
                           {gpu::reads(0, buffers.derivatives), gpu::writes(1, buffers.blurred)}, push,
                           element_groups(shape, loss_column_items(push.stride, push.size[1]), 9));
    }
};

}  // namespace ewa::passes
