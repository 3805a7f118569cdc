// SPDX-License-Identifier: Apache-2.0
// Adam's step of one photograph's exposure.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct ExposureUpdate {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& sums;
        const gpu::Buffer& exposures;
        const gpu::Buffer& moments1;
        const gpu::Buffer& moments2;
        const gpu::Buffer& counts;
    };

    ExposureUpdate(gpu::Device& device, const Shape& shape)
        : pipeline(
              device, "exposure_update", shader_code("exposure_update"),
              {spec(shared::SPEC_GROUP_SIZE, shape.subgroup), spec(shared::SPEC_SUBGROUP, shape.subgroup)}) {}

    void record(gpu::Recording& recording, const Buffers& buffers,
                const shared::ExposureUpdatePush& push) const {
        recording.dispatch(pipeline, "exposure_update",
                           {gpu::reads(0, buffers.sums), gpu::updates(1, buffers.exposures),
                            gpu::updates(2, buffers.moments1), gpu::updates(3, buffers.moments2),
                            gpu::updates(4, buffers.counts)},
                           push, {1, 1, 1});
    }
};

}  // namespace ewa::passes
