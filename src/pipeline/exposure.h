// SPDX-License-Identifier: Apache-2.0
// What each photograph's exposure makes of a picture: an affine map of colours, learned beside the splats (as
// the published code of 3DGS does for captures with automatic exposure; see include/ewa/exposure.h).
#pragma once
#include <vector>

#include "ewa/exposure.h"
#include "gpu/buffer.h"
#include "gpu/recording.h"
#include "pipeline/frame.h"
#include "pipeline/kernels.h"

namespace ewa::pipeline {

/// Of all photographs, with Adam's moments.
struct Exposures {
    uint32_t photos = 0;
    gpu::Buffer values, moments1, moments2;

    Exposures() = default;
    Exposures(gpu::Device& device, size_t photos);
    uint64_t bytes() const { return 4ull * shared::EXPOSURE_FLOATS * photos; }  // of each buffer
    std::vector<Exposure> download() const;
};

/// A step of one photograph's exposure.
struct ExposureUse {
    const Exposures* exposures = nullptr;
    uint32_t photo = 0;
    float rate = 0;
    uint32_t visit = 1;  // which step of this photograph it is, from 1
};

/// frame.planes through the exposure into frame.exposed.
void record_expose(gpu::Recording& recording, Kernels& kernels, const Frame& frame, uint32_t width,
                   uint32_t height, const ExposureUse& use);

/// frame.image_gradient by the exposed picture becomes that by the picture; the exposure takes a step of
/// Adam.
void record_expose_backward(gpu::Recording& recording, Kernels& kernels, const Frame& frame, uint32_t width,
                            uint32_t height, const ExposureUse& use);

}  // namespace ewa::pipeline
