// SPDX-License-Identifier: Apache-2.0
// Moments of rendering and photograph, blurred down the columns.
#pragma once
#include "gpu/recording.h"
#include "passes/loss_items.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct LossColumns {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& image;
        const gpu::Buffer& target;
        const gpu::Buffer& moments;
    };

    LossColumns(gpu::Device& device, const Shape& shape)
        : pipeline(device, "loss_columns", shader_code("loss_columns"),
                   {spec(shared::SPEC_GROUP_SIZE, shape.group)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::LossPush& push) const {
        recording.dispatch(
            pipeline, "loss_columns",
            {gpu::reads(0, buffers.image), gpu::reads(1, buffers.target), gpu::writes(2, buffers.moments)},
            push, element_groups(shape, loss_column_items(push.stride, push.size[1]), 3));
    }
};

}  // namespace ewa::passes
