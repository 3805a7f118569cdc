// SPDX-License-Identifier: Apache-2.0
// SSIM and its derivatives by the rendering's moments.
#pragma once
#include "gpu/recording.h"
#include "passes/loss_items.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct LossRows {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& moments;
        const gpu::Buffer& derivatives;
        const gpu::Buffer& partials;
    };

    LossRows(gpu::Device& device, const Shape& shape)
        : pipeline(
              device, "loss_rows", shader_code("loss_rows"),
              {spec(shared::SPEC_GROUP_SIZE, shape.group), spec(shared::SPEC_SUBGROUP, shape.subgroup)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::LossPush& push) const {
        recording.dispatch(pipeline, "loss_rows",
                           {gpu::reads(0, buffers.moments), gpu::writes(1, buffers.derivatives),
                            gpu::writes(2, buffers.partials)},
                           push, element_groups(shape, loss_row_items(push.stride, push.size[1]), 3));
    }
};

}  // namespace ewa::passes
