// SPDX-License-Identifier: Apache-2.0
// The gradient by the rendering, from that by the masked rendering.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct MaskGradient {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& photo;
        const gpu::Buffer& image_gradient;
    };

    MaskGradient(gpu::Device& device, const Shape& shape)
        : pipeline(device, "mask_gradient", shader_code("mask_gradient"),
                   {spec(shared::SPEC_GROUP_SIZE, shape.group)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::MaskPush& push) const {
        recording.dispatch(pipeline, "mask_gradient",
                           {gpu::reads(0, buffers.photo), gpu::updates(1, buffers.image_gradient)}, push,
                           element_groups(shape, uint64_t(push.size[0]) * push.size[1]));
    }
};

}  // namespace ewa::passes
