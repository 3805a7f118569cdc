// SPDX-License-Identifier: Apache-2.0
// Light that reaches a camera, by path tracing.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

/// What rays meet; shared/layouts.h says how each is filled.
struct MeshBuffers {
    const gpu::Buffer& nodes;
    const gpu::Buffer& triangles;
    const gpu::Buffer& surfaces;
    const gpu::Buffer& materials;
    const gpu::Buffer& textures;
    const gpu::Buffer& texels;
};

struct TracePaths {
    gpu::Pipeline pipeline;

    struct Buffers {
        MeshBuffers mesh;
        const gpu::Buffer& lights;
        const gpu::Buffer& view;
        const gpu::Buffer& sums;
        const gpu::Buffer& counts;
    };

    TracePaths(gpu::Device& device, const Shape& shape, bool alpha_tested)
        : pipeline(device, "trace_paths", shader_code("trace_paths"),
                   {spec(shared::SPEC_GROUP_SIZE, shape.group),
                    spec(shared::SPEC_ALPHA_TESTED, alpha_tested ? 1u : 0u)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers, uint64_t pixels,
                const shared::TracePush& push) const {
        recording.dispatch(pipeline, "trace_paths",
                           {gpu::reads(0, buffers.mesh.nodes), gpu::reads(1, buffers.mesh.triangles),
                            gpu::reads(2, buffers.mesh.surfaces), gpu::reads(3, buffers.mesh.materials),
                            gpu::reads(4, buffers.mesh.textures), gpu::reads(5, buffers.mesh.texels),
                            gpu::reads(6, buffers.lights), gpu::reads(7, buffers.view),
                            gpu::updates(8, buffers.sums), gpu::updates(9, buffers.counts)},
                           push, element_groups(shape, pixels));
    }
};

}  // namespace ewa::passes
