// SPDX-License-Identifier: Apache-2.0
// The metrics behind include/ewa/metrics.h. a is the image that is judged, b the reference. Both have equal sizes and at least
// 3 channels, of which the first three count, clamped to [0, 1]. weights: of each pixel, one channel; an empty image means
// equal weights. Every function throws InputError if the sizes differ, and returns NaN if all weights are zero.
#pragma once
#include <array>

#include "ewa/image.h"

namespace ewa::image {

/// The number of channels to compare: RGB, without alpha. Throws InputError.
int compared_channels(const Image& a, const Image& b);
/// The sum of the pixels' weights. Throws InputError if the weights have another size than the image.
double weight_sum(const Image& weights, const Image& image);

inline double weight_at(const Image& weights, int x, int y) {
    return weights.pixels.empty() ? 1.0 : double(*weights.at(x, y));
}

/// Blends b towards a by each pixel's weight: a at weight 1, b at weight 0. So pixels of weight 0 add no difference to metrics that
/// compare windows of pixels.
Image pulled_onto(const Image& a, const Image& b, const Image& weights);

/// Mean SSIM as ewa::ssim, over the pixels whose whole window is in the image. NaN if there are none.
double ssim_valid(const Image& a, const Image& b, const Image& weights);
/// Multi-scale SSIM (Wang et al. 2003): five scales by means of 2 x 2 pixels, windows wholly in the image, negative factors as
/// 0. NaN if a side is under 176 px: the window must fit on the coarsest scale.
double ms_ssim(const Image& a, const Image& b, const Image& weights);

/// The blur effect of Crete et al. 2007: the share of the differences between neighbours that a box filter of 11 px leaves, along
/// rows or columns, whichever is larger. From 0 (sharp) to 1; it depends little on what the image shows. 0 for a flat image.
double blur_effect(const Image& image);

/// Per channel, the inverse of the affine map that takes b to a in the least-squares sense, applied to a (gsplat's
/// color_correct_affine).
Image affine_corrected(const Image& a, const Image& b, const Image& weights);
/// Per channel, the affine map of a that comes closest to b in the least-squares sense.
Image affine_fitted(const Image& a, const Image& b, const Image& weights);
/// Five rounds of the quadratic map of a's colours that comes closest to b in the least-squares sense, without pixels that are
/// saturated (multinerf's color_correct).
Image quadratic_corrected(const Image& a, const Image& b, const Image& weights);

/// Mean of LDR-FLIP's error map (Andersson et al. 2020) at 67.02 pixels a degree, as flip-evaluator.
double flip(const Image& a, const Image& b, const Image& weights);

/// The PSNR of each frequency band of the difference image. Let D_k be its means over squares of 2^k px, from the top left corner.
/// Band k < 4 is D_k - D_(k+1), and the last is D_4. The bands are orthogonal and add up to the difference, so their mean squares add
/// up to the MSE.
constexpr size_t kBands = 5;
std::array<double, kBands> band_psnr(const Image& a, const Image& b, const Image& weights);

}  // namespace ewa::image
