// SPDX-License-Identifier: Apache-2.0
// Moves the means by noise of the splats' shapes.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct Perturb {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& params;
        const gpu::Buffer& counts;
    };

    Perturb(gpu::Device& device, const Shape& shape)
        : pipeline(device, "perturb", shader_code("perturb"), {spec(shared::SPEC_GROUP_SIZE, shape.group)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::PerturbPush& push) const {
        recording.dispatch(pipeline, "perturb",
                           {gpu::updates(0, buffers.params), gpu::updates(1, buffers.counts)}, push,
                           element_groups(shape, push.splats));
    }
};

}  // namespace ewa::passes
