// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "ewa/error.h"
#include "ewa/image.h"
#include "shared/constants.h"

namespace ewa {

namespace {

constexpr int kRadius = static_cast<int>(shared::SSIM_RADIUS);
constexpr int kTaps = 2 * kRadius + 1;

/// Channels that are compared: RGB, without alpha.
int compared_channels(const Image& a, const Image& b) {
    const int channels = std::min(a.channels, 3);
    if (a.width != b.width || a.height != b.height || channels != std::min(b.channels, 3) || a.pixels.empty())
        throw InputError("pictures of " + std::to_string(a.width) + " x " + std::to_string(a.height) + " x " +
                         std::to_string(a.channels) + " and " + std::to_string(b.width) + " x " +
                         std::to_string(b.height) + " x " + std::to_string(b.channels) +
                         " cannot be compared");
    return channels;
}

double clamped(float value) {
    return std::clamp(double(value), 0.0, 1.0);
}

std::array<double, kTaps> window() {
    std::array<double, kTaps> taps;
    double sum = 0;
    for (int i = 0; i < kTaps; ++i) {
        const double d = i - kRadius;
        sum += taps[size_t(i)] = std::exp(-d * d / (2 * shared::SSIM_SIGMA * shared::SSIM_SIGMA));
    }
    for (double& tap : taps) tap /= sum;
    return taps;
}

/// Windowed sums at one pixel: of a, b, a a, b b, a b.
using Moments = std::array<double, 5>;

double ssim_of(const Moments& m) {
    const double mean_product = m[0] * m[1], mean_squares = m[0] * m[0] + m[1] * m[1];
    const double variances = m[2] + m[3] - mean_squares, covariance = m[4] - mean_product;
    return (2 * mean_product + shared::SSIM_C1) * (2 * covariance + shared::SSIM_C2) /
           ((mean_squares + shared::SSIM_C1) * (variances + shared::SSIM_C2));
}

/// The window along x at every pixel of a row.
void blur_row(const Image& a, const Image& b, int y, int channel, const std::array<double, kTaps>& taps,
              std::vector<Moments>& row) {
    for (int x = 0; x < a.width; ++x) {
        Moments sums{};
        for (int i = std::max(0, x - kRadius); i <= std::min(a.width - 1, x + kRadius); ++i) {
            const double tap = taps[size_t(i - x + kRadius)];
            const double va = clamped(a.at(i, y)[channel]), vb = clamped(b.at(i, y)[channel]);
            sums[0] += tap * va;
            sums[1] += tap * vb;
            sums[2] += tap * va * va;
            sums[3] += tap * vb * vb;
            sums[4] += tap * va * vb;
        }
        row[size_t(x)] = sums;
    }
}

double weight_at(const Image& weights, int x, int y) {
    return weights.pixels.empty() ? 1.0 : double(*weights.at(x, y));
}

double weight_sum(const Image& weights, const Image& picture) {
    if (weights.pixels.empty()) return double(picture.width) * picture.height;
    if (weights.width != picture.width || weights.height != picture.height || weights.channels != 1)
        throw InputError("the weights of a picture have another size");
    double sum = 0;
    for (const float weight : weights.pixels) sum += double(weight);
    return sum;
}

/// Weighted sum of SSIM over the pixels of a channel. Only the rows under the window are held, however tall
/// the picture.
double ssim_sum(const Image& a, const Image& b, const Image& weights, int channel,
                const std::array<double, kTaps>& taps) {
    std::array<std::vector<Moments>, kTaps> rows;
    for (auto& row : rows) row.resize(size_t(a.width));
    double total = 0;
    int blurred = 0;
    for (int y = 0; y < a.height; ++y) {
        for (; blurred <= std::min(a.height - 1, y + kRadius); ++blurred)
            blur_row(a, b, blurred, channel, taps, rows[size_t(blurred % kTaps)]);
        for (int x = 0; x < a.width; ++x) {
            Moments sums{};
            for (int j = std::max(0, y - kRadius); j <= std::min(a.height - 1, y + kRadius); ++j)
                for (size_t k = 0; k < sums.size(); ++k)
                    sums[k] += taps[size_t(j - y + kRadius)] * rows[size_t(j % kTaps)][size_t(x)][k];
            total += weight_at(weights, x, y) * ssim_of(sums);
        }
    }
    return total;
}

}  // namespace

double psnr(const Image& a, const Image& b) {
    return psnr(a, b, {});
}

double psnr(const Image& a, const Image& b, const Image& weights) {
    const int channels = compared_channels(a, b);
    const double count = weight_sum(weights, a);
    double sum = 0;
    for (int y = 0; y < a.height; ++y)
        for (int x = 0; x < a.width; ++x)
            for (int c = 0; c < channels; ++c) {
                const double difference = clamped(a.at(x, y)[c]) - clamped(b.at(x, y)[c]);
                sum += weight_at(weights, x, y) * difference * difference;
            }
    if (count == 0) return std::numeric_limits<double>::quiet_NaN();
    if (sum == 0) return std::numeric_limits<double>::infinity();
    return -10 * std::log10(sum / (count * channels));
}

double ssim(const Image& a, const Image& b) {
    return ssim(a, b, {});
}

double ssim(const Image& a, const Image& b, const Image& weights) {
    const int channels = compared_channels(a, b);
    const double count = weight_sum(weights, a);
    Image pulled = a;
    if (!weights.pixels.empty())
        for (int y = 0; y < a.height; ++y)
            for (int x = 0; x < a.width; ++x)
                for (int c = 0; c < channels; ++c) {
                    const float weight = *weights.at(x, y);
                    pulled.at(x, y)[c] = weight * a.at(x, y)[c] + (1 - weight) * b.at(x, y)[c];
                }
    const std::array<double, kTaps> taps = window();
    double sum = 0;
    for (int c = 0; c < channels; ++c) sum += ssim_sum(pulled, b, weights, c, taps);
    return sum / (count * channels);
}

}  // namespace ewa
