// SPDX-License-Identifier: Apache-2.0
// Gradient of the projection, fused with Adam. mode: see the shader.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct Update {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& params;
        const gpu::Buffer& camera;
        uint64_t camera_offset;
        const gpu::Buffer& records;
        const gpu::Buffer& slots;
        const gpu::Buffer& moments1;
        const gpu::Buffer& moments2;
        const gpu::Buffer& tile_counts;
        const gpu::Buffer& first_instances;
        const gpu::Buffer& places;
        const gpu::Buffer& counts;
        const gpu::Buffer& params_out;
        const gpu::Buffer& moments1_out;
        const gpu::Buffer& moments2_out;
        const gpu::Buffer& statistics;
    };

    Update(gpu::Device& device, const Shape& shape, uint32_t sh_degree, uint32_t kernel, uint32_t mode)
        : pipeline(device, "update", shader_code("update"),
                   {spec(shared::SPEC_GROUP_SIZE, shape.group), spec(shared::SPEC_SH_DEGREE, sh_degree),
                    spec(shared::SPEC_KERNEL, kernel), spec(shared::SPEC_MODE, mode)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::UpdatePush& push) const {
        recording.dispatch(
            pipeline, "update",
            {gpu::reads(0, buffers.params),
             gpu::reads_part(1, buffers.camera, buffers.camera_offset, sizeof(shared::CameraBlock)),
             gpu::reads(2, buffers.records), gpu::reads(3, buffers.slots), gpu::reads(4, buffers.moments1),
             gpu::reads(5, buffers.moments2), gpu::reads(6, buffers.tile_counts),
             gpu::reads(7, buffers.first_instances), gpu::updates(8, buffers.counts),
             gpu::writes(9, buffers.params_out), gpu::writes(10, buffers.moments1_out),
             gpu::writes(11, buffers.moments2_out), gpu::updates(12, buffers.statistics),
             gpu::reads(13, buffers.places)},
            push, element_groups(shape, push.splats));
    }
};

}  // namespace ewa::passes
