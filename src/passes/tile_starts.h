// SPDX-License-Identifier: Apache-2.0
// Finds where each tile's instances begin in the sorted list.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct TileStarts {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& keys;
        const gpu::Buffer& counts;
        const gpu::Buffer& tile_starts;
    };

    TileStarts(gpu::Device& device, const Shape& shape)
        : pipeline(device, "tile_starts", shader_code("tile_starts"),
                   {spec(shared::SPEC_GROUP_SIZE, shape.group)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::TileStartsPush& push) const {
        recording.dispatch(
            pipeline, "tile_starts",
            {gpu::reads(0, buffers.keys), gpu::reads(1, buffers.counts), gpu::writes(2, buffers.tile_starts)},
            push, element_groups(shape, uint64_t(push.tiles) + 2));
    }
};

}  // namespace ewa::passes
