// SPDX-License-Identifier: Apache-2.0
// Turns the colour planes into 8-bit RGBA.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct Pack {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& planes;
        const gpu::Buffer& packed;  // plane_floats words
    };

    Pack(gpu::Device& device, const Shape& shape)
        : pipeline(device, "pack", shader_code("pack"), {spec(shared::SPEC_GROUP_SIZE, shape.group)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::PackPush& push) const {
        recording.dispatch(pipeline, "pack", {gpu::reads(0, buffers.planes), gpu::writes(1, buffers.packed)},
                           push, element_groups(shape, push.plane_floats / 4));
    }
};

}  // namespace ewa::passes
