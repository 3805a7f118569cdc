// SPDX-License-Identifier: Apache-2.0
// Loss and backward passes: from image planes to moved parameters, or to their gradient.
#pragma once
#include "pipeline/exposure.h"
#include "pipeline/forward.h"

namespace ewa::pipeline {

struct Rates {
    float mean = 0, opacity = 0, quaternion = 0, scale = 0, sh0 = 0, sh_rest = 0;
    uint32_t step = 1;  // Adam's, from 1
    // With plan.regularised: d(loss)/d(opacity) and d(loss)/d(scale along one axis) of every splat.
    float opacity_weight = 0, scale_weight = 0;
};

/// Leaves the parts of the loss in Counts and dL/d(image) in frame.image_gradient.
/// photo: width * height texels, RGBA. Its alpha composites it over the background or, if `masked`, is the
/// weight of each pixel; `frame` must then be reserved with masks.
/// exposure: that of the training image, if exposures are learned. It takes its own step of Adam; `frame`
/// must be reserved with exposure.
void record_loss(gpu::Recording& recording, passes::PassCache& cache, const FrameBuffers& frame,
                 const FrameInputs& inputs, const gpu::Buffer& photo, bool masked = false,
                 const ExposureUse* exposure = nullptr);

/// Gradients of blending and projection. With plan.adam it moves the model; without, it writes
/// the gradient to model.moments1.
void record_backward(gpu::Recording& recording, passes::PassCache& cache, const Plan& plan,
                     const Model& model, const FrameBuffers& frame, const FrameInputs& inputs,
                     const Sorted& sorted, const Rates& rates);

/// (1 - SSIM_WEIGHT) l1 + SSIM_WEIGHT (1 - ssim).
double loss_of(const shared::Counts& counts);

}  // namespace ewa::pipeline
