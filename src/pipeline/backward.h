// SPDX-License-Identifier: Apache-2.0
// Loss and the way back: from image planes to moved parameters (or to their gradient).
#pragma once
#include "pipeline/exposure.h"
#include "pipeline/forward.h"

namespace ewa::pipeline {

struct Rates {
    float mean = 0, opacity = 0, quaternion = 0, scale = 0, sh0 = 0, sh_rest = 0;
    uint32_t step = 1;  // Adam's, from 1
    // Where plan.regularised: d(loss)/d(opacity) and d(loss)/d(scale along one axis) of every splat.
    float opacity_weight = 0, scale_weight = 0;
};

/// photo: width * height texels, RGBA. Its alpha cuts it out of the background or, where `masked`, says how
/// much each pixel counts (the frame then has to have been asked for with masks). Leaves the loss's parts in
/// Counts and dL/d(image) in frame.image_gradient. exposure, where there is one: the photograph's, which
/// takes a step itself (the frame then has to have been asked for with exposure).
void record_loss(gpu::Recording& recording, Kernels& kernels, const Frame& frame, const CameraUse& camera,
                 const std::array<float, 3>& background, const gpu::Buffer& photo, bool masked = false,
                 const ExposureUse* exposure = nullptr);

/// Blend backward and projection backward. plan.adam: moves the model; else writes the gradient to
/// model.moments1.
void record_backward(gpu::Recording& recording, Kernels& kernels, const Plan& plan, const Model& model,
                     const Frame& frame, const CameraUse& camera, const std::array<float, 3>& background,
                     const Sorted& sorted, const Rates& rates);

/// (1 - SSIM_WEIGHT) l1 + SSIM_WEIGHT (1 - ssim).
double loss_of(const shared::Counts& counts);

}  // namespace ewa::pipeline
