// SPDX-License-Identifier: Apache-2.0
// Finds objects that a single training image shows: people who pass by, cars, a hand. A model of all images shows them faintly. So
// its render differs from that image by far more there than elsewhere, and the difference has sharp borders.
#pragma once
#include <vector>

#include "ewa/image.h"

namespace ewa::train {

/// Differences between a render and its training image, in cells of some pixels.
struct Residual {
    int columns = 0, rows = 0;  // pixels
    int width = 0, height = 0;  // cells
    std::vector<float> errors;  // mean absolute difference over a cell and its neighbours
    std::vector<bool> counts;   // whether most of the cell's pixels count
    double median = 0;          // of the errors that count; 0 if none does
};

/// The render is first fitted to the image by a gain and an offset of each channel, since images may differ in exposure.
/// weights: of the image's pixels, one channel; empty: all count. The images have one size.
Residual residual_of(const Image& image, const Image& weights, const Image& render);

/// A mask for each training image, of one channel and the size of the compared images: 0 at objects that only this image shows, else
/// 1. An image without such objects has an empty mask.
std::vector<Image> passers_by(const std::vector<Residual>& residuals);

}  // namespace ewa::train
