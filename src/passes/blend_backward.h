// SPDX-License-Identifier: Apache-2.0
// Gradient of blending into the slot of every (splat, tile) instance.
#pragma once
#include "gpu/recording.h"
#include "passes/shader_code.h"
#include "passes/shape.h"

namespace ewa::passes {

struct BlendBackward {
    gpu::Pipeline pipeline;

    struct Buffers {
        const gpu::Buffer& records;
        const gpu::Buffer& splats;
        const gpu::Buffer& tile_starts;
        const gpu::Buffer& planes;
        const gpu::Buffer& image_gradient;
        const gpu::Buffer& slots;
    };

    /// mode: see the shader.
    BlendBackward(gpu::Device& device, const Shape& shape, uint32_t mode)
        : pipeline(
              device, "blend_backward", shader_code("blend_backward"),
              {spec_float(shared::SPEC_CUT_OFF, shape.cut_off), spec(shared::SPEC_GROUP_SIZE, shape.subgroup),
               spec(shared::SPEC_SUBGROUP, shape.subgroup), spec(shared::SPEC_TILE_WIDTH, shape.tile_width),
               spec(shared::SPEC_TILE_HEIGHT, shape.tile_height), spec(shared::SPEC_MODE, mode)}) {}

    void record(gpu::Recording& recording, const Shape& shape, const Buffers& buffers,
                const shared::BlendPush& push) const {
        recording.dispatch(pipeline, "blend_backward",
                           {gpu::reads(0, buffers.records), gpu::reads(1, buffers.splats),
                            gpu::reads(2, buffers.tile_starts), gpu::reads(3, buffers.planes),
                            gpu::reads(4, buffers.image_gradient), gpu::writes(5, buffers.slots)},
                           push, tile_groups(shape, push));
    }
};

}  // namespace ewa::passes
