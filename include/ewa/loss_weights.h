// SPDX-License-Identifier: Apache-2.0
// The loss of a training.
#pragma once

namespace ewa {

/// Weights of the terms of the loss, 0 or more:
///   l1 mean|x - y| + l2 mean (x - y)^2 + ssim (1 - mean SSIM)
/// x is the render and y the training image, with means over pixels and RGB. The usual values are those of 3DGS.
/// The square of a difference above 16 grows linearly.
struct LossWeights {
    double l1 = 0.8, l2 = 0, ssim = 0.2;

    bool operator==(const LossWeights&) const = default;
};

}  // namespace ewa
