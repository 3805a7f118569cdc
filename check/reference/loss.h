// SPDX-License-Identifier: Apache-2.0
// The training loss of an image and its gradient.
//
//   L    = l1 mean|x - y| + l2 mean (x - y)^2 + ssim (1 - mean SSIM)         means over pixels and RGB; LossWeights
//   SSIM = (2 mx my + C1)(2 sxy + C2) / ((mx^2 + my^2 + C1)(sxx + syy + C2)) Wang et al. 2004, eq. 13
// with mx = w * x, sxx = w * x^2 - mx^2, sxy = w * xy - mx my and so on. w is a Gaussian window whose weights
// add up to 1, zero padded at the border (3DGS, utils/loss_utils.py), where the sums are therefore smaller.
// The render x is not clamped to [0, 1]. SSIM clamps both images to [-SSIM_LIMIT, SSIM_LIMIT]. The square of a difference
// d > m = SSIM_LIMIT is m (2 d - m).
//
// w is symmetric. With mx, E[xx] and E[xy] as the variables of the partial derivatives:
//   dSSIM/dx = w * (dSSIM/dmx) + 2 x (w * dSSIM/dE[xx]) + y (w * dSSIM/dE[xy])
// The derivative of |.| at 0 is 0.
//
// With a pixel weight m, x' = m x + (1 - m) y replaces x, so dL/dx = m dL/dx'.
#pragma once
#include <array>
#include <vector>

#include "ewa/loss_weights.h"
#include "reference/values.h"

namespace ewa::reference {

struct Loss {
    double loss = 0, l1 = 0, l2 = 0, ssim = 0;
    double squared = 0;  // mean (x - y)^2, both clamped to [0, 1]
    Raster gradient;     // dL/d(rendered), RGB
};

/// The loss of a render. Both images are RGB and of one size.
Loss image_loss(const Raster& rendered, const Raster& target, const LossWeights& terms = {});

/// The loss with a weight in [0, 1] for each pixel. weights: one channel, of the images' size.
Loss image_loss(const Raster& rendered, const Raster& target, const Raster& weights,
                const LossWeights& terms = {});

struct AlphaLoss {
    double difference = 0;  // mean |1 - T - alpha|
    Raster gradient;        // d(difference)/dT, one channel
};
/// The loss of the render's opacity. Both images have one channel and one size.
AlphaLoss alpha_loss(const Raster& transmittance, const Raster& alpha);

struct DepthLoss {
    double difference = 0;   // mean |ln(depth_sum / (1 - T)) - ln(depth)| over all pixels
    Raster by_sum, by_left;  // d(difference)/d(depth_sum) and by T, one channel each
};
/// All of one channel and one size. Pixels whose depth is 0 or whose opacity 1 - T is below DEPTH_OPACITY_MIN count as 0.
DepthLoss depth_loss(const Raster& depth_sum, const Raster& transmittance, const Raster& depths);

/// The window's 2 * SSIM_RADIUS + 1 taps along one axis.
std::vector<double> ssim_window();

// The exposure of a training image (include/ewa/appearance.h), and the gradient through it:
//   c' = M c + b:   dL/dc = M^T dL/dc',   dL/dM = sum over pixels of dL/dc' c^T,   dL/db = sum of dL/dc'

/// Three rows of (matrix row, offset).
using Exposure = std::array<double, 12>;

/// The RGB image with the exposure applied.
Raster exposed(const Raster& image, const Exposure& exposure);

struct ExposureGradient {
    Raster image;         // dL/d(image)
    Exposure exposure{};  // dL/d(exposure)
};
/// `image` is the image before the exposure, `gradient` is dL/d(exposed image).
ExposureGradient exposed_backward(const Raster& image, const Exposure& exposure, const Raster& gradient);

}  // namespace ewa::reference
