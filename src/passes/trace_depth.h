// SPDX-License-Identifier: Apache-2.0
// What the centre of each pixel sees.
#pragma once
#include "passes/trace_paths.h"

namespace ewa::passes {

struct TraceDepth {
    gpu::Pipeline pipeline;

    struct Buffers {
        MeshBuffers mesh;
        const gpu::Buffer& view;
        const gpu::Buffer& seen;
        const gpu::Buffer& counts;
    };

    TraceDepth(gpu::Device& device, const Shape& shape, bool alpha_tested)
        : pipeline(device, "trace_depth", shader_code("trace_depth"),
                   {spec(shared::SPEC_GROUP_SIZE, shape.group),
                    spec(shared::SPEC_ALPHA_TESTED, alpha_tested ? 1u : 0u)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers, uint64_t pixels,
                const shared::TracePush& push) const {
        recording.dispatch(
            pipeline, "trace_depth",
            {gpu::reads(0, buffers.mesh.nodes), gpu::reads(1, buffers.mesh.triangles),
             gpu::reads(2, buffers.mesh.surfaces), gpu::reads(3, buffers.mesh.materials),
             gpu::reads(4, buffers.mesh.textures), gpu::reads(5, buffers.mesh.texels),
             gpu::reads(6, buffers.view), gpu::writes(7, buffers.seen), gpu::updates(8, buffers.counts)},
            push, element_groups(shape, pixels));
    }
};

}  // namespace ewa::passes
