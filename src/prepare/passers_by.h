// SPDX-License-Identifier: Apache-2.0
// What one training image shows and the others do not: people who pass by, cars, a hand. A model of all images shows it faintly.
// Its render then differs from that image by far more than elsewhere, and the difference ends abruptly.
#pragma once
#include <vector>

#include "ewa/image.h"

namespace ewa::train {

/// How far a render is from its training image, in cells of some pixels.
struct Residual {
    int columns = 0, rows = 0;  // pixels
    int width = 0, height = 0;  // cells
    std::vector<float> errors;  // mean absolute difference over a cell and its neighbours
    std::vector<bool> counts;   // whether most of the cell's pixels count
    double median = 0;          // of the errors that count; 0 if none does
};

/// The gain and offset of each channel that fit the render to the image are taken out, since images may differ in exposure.
/// weights: of the image's pixels, one channel; empty: all count. The images have one size.
Residual residual_of(const Image& image, const Image& weights, const Image& render);

/// A mask for each training image, of one channel and the size of the compared images: 0 where the image shows what the others do not,
/// else 1. Without pixels where there is nothing such.
std::vector<Image> passers_by(const std::vector<Residual>& residuals);

}  // namespace ewa::train
