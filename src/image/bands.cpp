// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "image/metric.h"

namespace ewa::image {
namespace {

/// Sums over squares of pixels: of weight times difference, and of weights.
struct SquareSums {
    int width = 0, height = 0;
    std::vector<double> differences, weights;

    SquareSums(int width_, int height_)
        : width(width_),
          height(height_),
          differences(size_t(width) * size_t(height)),
          weights(differences.size()) {}
    /// The sums of squares with twice the side. Those at the right and lower edge may be cut.
    SquareSums doubled() const {
        SquareSums result((width + 1) / 2, (height + 1) / 2);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const size_t from = size_t(y) * size_t(width) + size_t(x);
                const size_t to = size_t(y / 2) * size_t(result.width) + size_t(x / 2);
                result.differences[to] += differences[from];
                result.weights[to] += weights[from];
            }
        return result;
    }
    /// The sum over the pixels of the squared mean of each pixel's square.
    double energy() const {
        double sum = 0;
        for (size_t i = 0; i < weights.size(); ++i)
            if (weights[i] > 0) sum += differences[i] * differences[i] / weights[i];
        return sum;
    }
};

SquareSums difference_of(const Image& a, const Image& b, const Image& weights, int channel) {
    SquareSums result(a.width, a.height);
    size_t i = 0;
    for (int y = 0; y < a.height; ++y)
        for (int x = 0; x < a.width; ++x, ++i) {
            const double weight = weight_at(weights, x, y);
            const double difference = std::clamp(double(a.at(x, y)[channel]), 0.0, 1.0) -
                                      std::clamp(double(b.at(x, y)[channel]), 0.0, 1.0);
            result.weights[i] = weight;
            result.differences[i] = weight * difference;
        }
    return result;
}

}  // namespace

std::array<double, kBands> band_psnr(const Image& a, const Image& b, const Image& weights) {
    const int channels = compared_channels(a, b);
    const double values = weight_sum(weights, a) * channels;
    std::array<double, kBands> result{};
    for (int channel = 0; channel < channels; ++channel) {
        SquareSums sums = difference_of(a, b, weights, channel);
        double energy = sums.energy();
        for (size_t k = 0; k + 1 < kBands; ++k) {
            sums = sums.doubled();
            const double coarser = sums.energy();
            result[k] += std::max(0.0, std::exchange(energy, coarser) - coarser);
        }
        result.back() += energy;
    }
    for (double& band : result)
        band = values == 0 ? std::numeric_limits<double>::quiet_NaN() : -10 * std::log10(band / values);
    return result;
}

}  // namespace ewa::image
