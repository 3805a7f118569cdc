// SPDX-License-Identifier: Apache-2.0
// The loss of a training.
#pragma once

namespace ewa {

/// The value kAutomaticAlphaWeight of LossWeights::alpha stands for kUsualAlphaWeight where images are transparent, else for 0.
inline constexpr double kAutomaticAlphaWeight = -1, kUsualAlphaWeight = 0.2;

/// Weights of the terms of the loss, 0 or more:
///   l1 mean|x - y| + l2 mean (x - y)^2 + ssim (1 - mean SSIM) + alpha mean|A - a| + depth mean|ln D - ln d|
///   + sfm_depth mean|ln D - ln p|.
/// x is the render and y the training image, with means over pixels and RGB. The usual values are those of 3DGS. The square of a
/// difference above 16 grows linearly. A is the opacity of the render, and a the alpha of the training image. Images that are
/// nowhere transparent, or whose alpha weights the pixels, have no alpha term. D is the mean depth of the render, and d that of the
/// training image's depth map. Logarithms make the weight independent of the scene's unit, and far and near surfaces count alike.
/// Pixels without a depth, or of an opacity below shared::DEPTH_OPACITY_MIN, add 0 to the mean over all pixels. p is the depth of a
/// point of the dataset that the image sees; the mean is over the pixels with such a point. A loss uses at most one of depth and
/// sfm_depth.
struct LossWeights {
    double l1 = 0.8, l2 = 0, ssim = 0.2, alpha = kAutomaticAlphaWeight, depth = 0, sfm_depth = 0;

    /// The weight of the depth term in use, depth or sfm_depth.
    double any_depth() const { return depth > 0 ? depth : sfm_depth; }

    bool operator==(const LossWeights&) const = default;
};

}  // namespace ewa
