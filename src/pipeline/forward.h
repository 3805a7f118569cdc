// SPDX-License-Identifier: Apache-2.0
// The forward frame: from parameters to image planes. The order of its passes is written here and nowhere
// else.
#pragma once
#include <array>

#include "gpu/recording.h"
#include "pipeline/frame.h"
#include "pipeline/kernels.h"
#include "pipeline/model.h"

namespace ewa::pipeline {

struct CameraUse {
    const gpu::Buffer* buffer = nullptr;  // CameraBlocks
    uint64_t offset = 0;                  // bytes, aligned as the device wants uniform blocks
    uint32_t width = 0, height = 0;       // px
};

/// Which of the ping-pong buffers hold the sorted instances after the forward frame.
struct Sorted {
    const gpu::Buffer* splats = nullptr;  // each instance's splat
    const gpu::Buffer* places =
        nullptr;  // with gradients: where each instance stands among the sorted, and its slot
};

/// Records: project, depth order, instances, tile order, tile starts, blend. Frame must have been reserved
/// for the model's splats and the camera's size. After the submission Counts.instances tells what was needed;
/// where that is more than frame.instance_capacity nothing was drawn, and the frame is to be repeated with
/// more room.
Sorted record_forward(gpu::Recording& recording, Kernels& kernels, const Plan& plan, const Model& model,
                      const Frame& frame, const CameraUse& camera, const std::array<float, 3>& background);

shared::BlendPush blend_push(const Kernels& kernels, const Frame& frame, const CameraUse& camera,
                             const std::array<float, 3>& background);

}  // namespace ewa::pipeline
