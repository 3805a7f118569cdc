// SPDX-License-Identifier: Apache-2.0
#include "image/pillow.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace ewa::image {
namespace {

/// Keys' cubic with a = -0.5.
double cubic(double x) {
    constexpr double kA = -0.5;
    x = std::abs(x);
    if (x < 1) return ((kA + 2) * x - (kA + 3)) * x * x + 1;
    return x < 2 ? (((x - 5) * x + 8) * x - 4) * kA : 0.0;
}

/// The old pixels that make a new one.
struct Support {
    int first = 0;
    std::vector<double> weights;
};

std::vector<Support> supports(int old_size, int new_size) {
    const double scale = double(old_size) / new_size, filter_scale = std::max(1.0, scale);
    std::vector<Support> result;
    for (int i = 0; i < new_size; ++i) {
        const double center = (i + 0.5) * scale;
        Support support;
        support.first = std::max(0, int(center - 2 * filter_scale + 0.5));
        const int end = std::min(old_size, int(center + 2 * filter_scale + 0.5));
        double sum = 0;
        for (int k = support.first; k < end; ++k) {
            support.weights.push_back(cubic((k - center + 0.5) / filter_scale));
            sum += support.weights.back();
        }
        for (double& weight : support.weights) weight /= sum;
        result.push_back(std::move(support));
    }
    return result;
}

/// The image with another width, and rows and columns exchanged.
Image resized_and_turned(const Image& image, int width) {
    if (width == image.width) return oriented(image, 5);
    const std::vector<Support> columns = supports(image.width, width);
    Image result(image.height, width, image.channels);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < image.channels; ++c) {
                const Support& support = columns[size_t(x)];
                double sum = 0;
                for (size_t k = 0; k < support.weights.size(); ++k)
                    sum += support.weights[k] * double(image.at(support.first + int(k), y)[c]);
                result.at(y, x)[c] = float(std::floor(255 * std::clamp(sum, 0.0, 1.0) + 0.5) / 255);
            }
    return result;
}

}  // namespace

Image resized_as_pillow(const Image& image, int width, int height) {
    return resized_and_turned(resized_and_turned(image, width), height);
}

}  // namespace ewa::image
