// SPDX-License-Identifier: Apache-2.0
// Photograph and rendering as the loss compares them where pixels are masked.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct MaskPictures {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& photo;
        const gpu::Buffer& image;
        const gpu::Buffer& target;
        const gpu::Buffer& masked;
    };

    MaskPictures(gpu::Device& device, const Shape& shape)
        : pipeline(device, "mask_pictures", shader_code("mask_pictures"),
                   {spec(shared::SPEC_GROUP_SIZE, shape.group)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::MaskPush& push) const {
        recording.dispatch(pipeline, "mask_pictures",
                           {gpu::reads(0, buffers.photo), gpu::reads(1, buffers.image),
                            gpu::writes(2, buffers.target), gpu::writes(3, buffers.masked)},
                           push, element_groups(shape, uint64_t(push.size[0]) * push.size[1]));
    }
};

}  // namespace ewa::passes
