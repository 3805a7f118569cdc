// SPDX-License-Identifier: Apache-2.0
// Spreads a photograph into planes.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct UnpackTarget {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& photo;
        const gpu::Buffer& planes;
    };

    UnpackTarget(gpu::Device& device, const Shape& shape)
        : pipeline(device, "unpack_target", shader_code("unpack_target"),
                   {spec(shared::SPEC_GROUP_SIZE, shape.group)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::UnpackPush& push) const {
        recording.dispatch(pipeline, "unpack_target",
                           {gpu::reads(0, buffers.photo), gpu::writes(1, buffers.planes)}, push,
                           element_groups(shape, uint64_t(push.size[0]) * push.size[1]));
    }
};

}  // namespace ewa::passes
