// SPDX-License-Identifier: Apache-2.0
// Writes the (splat, tile) instances in depth order. with_first: also where each splat's begin.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct EmitInstances {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& records;
        const gpu::Buffer& order;
        const gpu::Buffer& tile_counts;
        const gpu::Buffer& prefix;
        const gpu::Buffer& totals;
        const gpu::Buffer& counts;
        const gpu::Buffer& keys;
        const gpu::Buffer& splats;
        const gpu::Buffer& first_instances;
    };

    EmitInstances(gpu::Device& device, const Shape& shape, bool with_first)
        : pipeline(
              device, "emit_instances", shader_code("emit_instances"),
              {spec_float(shared::SPEC_CUT_OFF, shape.cut_off), spec(shared::SPEC_GROUP_SIZE, shape.group),
               spec(shared::SPEC_TILE_WIDTH, shape.tile_width),
               spec(shared::SPEC_TILE_HEIGHT, shape.tile_height), spec(shared::SPEC_MODE, with_first)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::EmitPush& push) const {
        recording.dispatch(
            pipeline, "emit_instances",
            {gpu::reads(0, buffers.records), gpu::reads(1, buffers.order), gpu::reads(2, buffers.tile_counts),
             gpu::reads(3, buffers.prefix), gpu::reads(4, buffers.totals), gpu::reads(5, buffers.counts),
             gpu::writes(6, buffers.keys), gpu::writes(7, buffers.splats),
             gpu::writes(8, buffers.first_instances)},
            push,
            element_groups(shape, push.splats, (push.tiles[1] + push.strip_rows - 1) / push.strip_rows));
    }
};

}  // namespace ewa::passes
