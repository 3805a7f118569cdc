// SPDX-License-Identifier: Apache-2.0
// Exposure of each training image: an affine map of colours, learned beside the splats. The published code of
// 3DGS does the same for captures with automatic exposure; see include/ewa/exposure.h.
#pragma once
#include <vector>

#include "ewa/exposure.h"
#include "gpu/buffer.h"
#include "passes/pass.h"
#include "pipeline/frame_buffers.h"

namespace ewa::pipeline {

/// Exposures of all training images, with Adam's moments.
struct Exposures {
    uint32_t photos = 0;
    gpu::Buffer values, moments1, moments2;

    Exposures() = default;
    Exposures(gpu::Device& device, size_t photos);
    uint64_t bytes() const { return 4ull * shared::EXPOSURE_FLOATS * photos; }  // of each buffer
    std::vector<Exposure> download() const;
};

/// A step of one training image's exposure.
struct ExposureUse {
    const Exposures* exposures = nullptr;
    uint32_t photo = 0;
    float rate = 0;
    uint32_t visit = 1;  // number of this image's step, from 1
};

/// Writes frame.planes with the exposure applied to frame.exposed.
void record_expose(gpu::Recording& recording, passes::PassCache& cache, const FrameBuffers& frame,
                   const ExposureUse& use);

/// Turns frame.image_gradient from dL/d(exposed image) into dL/d(image). The exposure takes a step of Adam.
void record_expose_backward(gpu::Recording& recording, passes::PassCache& cache, const FrameBuffers& frame,
                            const ExposureUse& use);

}  // namespace ewa::pipeline
