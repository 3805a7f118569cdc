// SPDX-License-Identifier: Apache-2.0
// Exclusive prefix sums within blocks. gathered: entry e is source[order[e]].
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct ScanBlocks {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& source;
        const gpu::Buffer& order;
        const gpu::Buffer& prefix;
        const gpu::Buffer& totals;
    };

    ScanBlocks(gpu::Device& device, const Shape& shape, bool gathered)
        : pipeline(device, "scan_blocks", shader_code("scan_blocks"),
                   {spec(shared::SPEC_GROUP_SIZE, shape.subgroup),
                    spec(shared::SPEC_SUBGROUP, shape.subgroup), spec(shared::SPEC_MODE, gathered)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::ScanPush& push, const char* name) const {
        recording.dispatch(pipeline, name,
                           {gpu::reads(0, buffers.source), gpu::reads(1, buffers.order),
                            gpu::writes(2, buffers.prefix), gpu::writes(3, buffers.totals)},
                           push,
                           subgroup_groups(shape, (uint64_t(push.items) + push.block - 1) / push.block));
    }
};

}  // namespace ewa::passes
