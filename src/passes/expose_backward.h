// SPDX-License-Identifier: Apache-2.0
// The gradient by the picture, in place, and partial sums of that by the exposure.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct ExposeBackward {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& image;
        const gpu::Buffer& exposures;
        const gpu::Buffer& image_gradient;
        const gpu::Buffer& sums;
    };

    ExposeBackward(gpu::Device& device, const Shape& shape)
        : pipeline(
              device, "expose_backward", shader_code("expose_backward"),
              {spec(shared::SPEC_GROUP_SIZE, shape.subgroup), spec(shared::SPEC_SUBGROUP, shape.subgroup)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::ExposurePush& push) const {
        const uint64_t pixels = uint64_t(push.size[0]) * push.size[1];
        recording.dispatch(
            pipeline, "expose_backward",
            {gpu::reads(0, buffers.image), gpu::reads(1, buffers.exposures),
             gpu::updates(2, buffers.image_gradient), gpu::writes(3, buffers.sums)},
            push, subgroup_groups(shape, (pixels + shared::EXPOSURE_BLOCK - 1) / shared::EXPOSURE_BLOCK));
    }
};

}  // namespace ewa::passes
