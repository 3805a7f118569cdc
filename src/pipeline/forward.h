// SPDX-License-Identifier: Apache-2.0
// The forward frame: from parameters to image planes. The order of its passes is written here only.
#pragma once
#include <array>

#include "pipeline/frame_buffers.h"
#include "pipeline/frame_inputs.h"
#include "pipeline/model.h"
#include "pipeline/plan.h"

namespace ewa::pipeline {

/// What the passes of a frame are recorded with.
struct FramePasses {
    gpu::Recording& recording;
    passes::PassCache& cache;
    const Plan& plan;
    const FrameBuffers& frame;
};

/// Which of the ping-pong buffers hold the sorted instances after the forward frame.
struct Sorted {
    const gpu::Buffer* splats = nullptr;   // each instance's splat
    const gpu::Buffer* indices = nullptr;  // with gradients: each emitted instance's sorted index and slot
};

/// Records: project, depth order, instances, tile order, tile starts, blend. `frame` must be reserved for the
/// model's splats and the camera's size. After the submission, Counts.instances is the number of instances
/// needed. If that exceeds frame.instance_capacity, the image is empty: repeat the frame with more capacity.
Sorted record_forward(const FramePasses& on, const Model& model, const FrameInputs& inputs);

/// The first part of a forward frame: clears the counts and projects the model's splats.
void record_projection(const FramePasses& on, const Model& model, const FrameInputs& inputs);

/// The rest of a forward frame: from frame's records, depth_keys[0] and tile_counts of `splats` splats to the image planes.
Sorted record_picture(const FramePasses& on, uint32_t splats, const FrameInputs& inputs);

/// The part between projection and blending: depth order, instances, tile order, tile starts. It reads frame's records,
/// depth_keys[0] and tile_counts, and leaves each tile's splats in instance_splats[1] and tile_starts; with gradients also
/// sorted_indices[1] and first_instances.
void record_tile_lists(gpu::Recording& recording, passes::PassCache& cache, bool gradients, uint32_t splats,
                       const FrameBuffers& frame);

/// The camera's block, as a binding.
gpu::BufferPart camera_part(const FrameInputs& inputs);

/// Intervals of a ray that a march evaluates together; most: a power of two.
uint32_t march_chunk(uint32_t samples, uint32_t most);

shared::BlendPush blend_push(const passes::KernelConfig& config, const FrameBuffers& frame,
                             const std::array<float, 3>& background);

}  // namespace ewa::pipeline
