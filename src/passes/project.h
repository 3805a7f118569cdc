// SPDX-License-Identifier: Apache-2.0
// Projects every splat: record, depth key and tile count. inspected 1: scales are shifted, the drawn are
// counted.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct Project {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& params;
        const gpu::Buffer& camera;
        uint64_t camera_offset;
        const gpu::Buffer& records;
        const gpu::Buffer& depth_keys;
        const gpu::Buffer& tile_counts;
        const gpu::Buffer& counts;
    };

    Project(gpu::Device& device, const Shape& shape, uint32_t sh_degree, uint32_t kernel,
            uint32_t inspected = 0)
        : pipeline(
              device, "project", shader_code("project"),
              {spec_float(shared::SPEC_CUT_OFF, shape.cut_off), spec(shared::SPEC_GROUP_SIZE, shape.group),
               spec(shared::SPEC_TILE_WIDTH, shape.tile_width),
               spec(shared::SPEC_TILE_HEIGHT, shape.tile_height), spec(shared::SPEC_SH_DEGREE, sh_degree),
               spec(shared::SPEC_KERNEL, kernel), spec(shared::SPEC_MODE, inspected)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::ProjectPush& push) const {
        recording.dispatch(
            pipeline, "project",
            {gpu::reads(0, buffers.params),
             gpu::reads_part(1, buffers.camera, buffers.camera_offset, sizeof(shared::CameraBlock)),
             gpu::writes(2, buffers.records), gpu::writes(3, buffers.depth_keys),
             gpu::writes(4, buffers.tile_counts), gpu::updates(5, buffers.counts)},
            push, element_groups(shape, push.splats));
    }
};

}  // namespace ewa::passes
