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

/// Windowed sums at the pixels of a row: of a, b, a a, b b, a b.
using Moments = std::array<std::vector<double>, 5>;

double ssim_of(const Moments& m, size_t x) {
    const double mean_product = m[0][x] * m[1][x], mean_squares = m[0][x] * m[0][x] + m[1][x] * m[1][x];
    const double variances = m[2][x] + m[3][x] - mean_squares, covariance = m[4][x] - mean_product;
    return (2 * mean_product + shared::SSIM_C1) * (2 * covariance + shared::SSIM_C2) /
           ((mean_squares + shared::SSIM_C1) * (variances + shared::SSIM_C2));
}

void clear(Moments& moments, int width) {
    for (auto& moment : moments) moment.assign(size_t(width), 0.0);
}

/// A row of one channel of both pictures, with zeros beyond its ends.
struct Rows {
    std::vector<double> a, b;
};

/// The window along x at every pixel of a row. Tap after tap over the row, which compilers vectorise.
void blur_row(const Rows& rows, const std::array<double, kTaps>& taps, Moments& sums) {
    const size_t width = rows.a.size() - 2 * kRadius;
    clear(sums, int(width));
    for (size_t i = 0; i < kTaps; ++i) {
        const double tap = taps[i];
        const double *a = &rows.a[i], *b = &rows.b[i];
        double *sa = sums[0].data(), *sb = sums[1].data(), *saa = sums[2].data(), *sbb = sums[3].data(),
               *sab = sums[4].data();
        for (size_t x = 0; x < width; ++x) {
            const double weighted_a = tap * a[x], weighted_b = tap * b[x];
            sa[x] += weighted_a;
            sb[x] += weighted_b;
            saa[x] += weighted_a * a[x];
            sbb[x] += weighted_b * b[x];
            sab[x] += weighted_a * b[x];
        }
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

/// a, pulled onto b where it weighs less, and b.
void read_rows(const Image& a, const Image& b, const Image& weights, int y, int channel, Rows& rows) {
    for (int x = 0; x < a.width; ++x) {
        float value = a.at(x, y)[channel];
        const float other = b.at(x, y)[channel];
        if (!weights.pixels.empty()) {
            const float weight = *weights.at(x, y);
            value = weight * value + (1 - weight) * other;
        }
        rows.a[size_t(x + kRadius)] = clamped(value);
        rows.b[size_t(x + kRadius)] = clamped(other);
    }
}

/// Weighted sum of SSIM over the pixels of a channel. Only the rows under the window are held, however tall
/// the picture.
double ssim_sum(const Image& a, const Image& b, const Image& weights, int channel,
                const std::array<double, kTaps>& taps) {
    std::array<Moments, kTaps> blurred_rows;
    Moments sums;
    Rows rows{std::vector<double>(size_t(a.width + 2 * kRadius)), {}};
    rows.b = rows.a;
    double total = 0;
    int blurred = 0;
    for (int y = 0; y < a.height; ++y) {
        for (; blurred <= std::min(a.height - 1, y + kRadius); ++blurred) {
            read_rows(a, b, weights, blurred, channel, rows);
            blur_row(rows, taps, blurred_rows[size_t(blurred % kTaps)]);
        }
        clear(sums, a.width);
        for (int j = std::max(0, y - kRadius); j <= std::min(a.height - 1, y + kRadius); ++j)
            for (size_t k = 0; k < sums.size(); ++k) {
                const double tap = taps[size_t(j - y + kRadius)];
                const double* from = blurred_rows[size_t(j % kTaps)][k].data();
                double* sum = sums[k].data();
                for (size_t x = 0; x < size_t(a.width); ++x) sum[x] += tap * from[x];
            }
        for (int x = 0; x < a.width; ++x) total += weight_at(weights, x, y) * ssim_of(sums, size_t(x));
    }
    return total;
}

Image with_opaque_alpha(const Image& image) {
    Image alpha(image.width, image.height, 1);
    for (float& value : alpha.pixels) value = 1;
    return with_alpha(image, alpha);
}

bool same(float a, float b) {
    return a == b || (std::isnan(a) && std::isnan(b));
}

/// All values; a and b have the same channels.
ImageDifference compare_values(const Image& a, const Image& b, double tolerance) {
    ImageDifference out;
    double sum = 0, sum_of_squares = 0;
    uint64_t last_over = 0;  // the pixel's number, from 1
    for (size_t i = 0; i < a.pixels.size(); ++i) {
        const float va = a.pixels[i], vb = b.pixels[i];
        if (same(va, vb)) continue;
        const double difference = double(va) - double(vb);
        sum_of_squares += difference * difference;
        const bool finite = std::isfinite(va) && std::isfinite(vb);
        const double error = finite ? double(std::abs(va - vb)) : std::numeric_limits<double>::infinity();
        if (finite) sum += error;
        const size_t pixel = i / size_t(a.channels);
        if (error > tolerance && pixel + 1 != last_over) {
            last_over = pixel + 1;
            ++out.over;
        }
        if (error <= out.max_error) continue;
        out.max_error = error;
        out.max_x = int(pixel % size_t(a.width));
        out.max_y = int(pixel / size_t(a.width));
        out.max_channel = int(i % size_t(a.channels));
    }
    out.mean_error = sum / double(a.pixels.size());
    out.rms_error = std::sqrt(sum_of_squares / double(a.pixels.size()));
    return out;
}

}  // namespace

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

double ssim(const Image& a, const Image& b, const Image& weights) {
    const int channels = compared_channels(a, b);
    const double count = weight_sum(weights, a);
    const std::array<double, kTaps> taps = window();
    double sum = 0;
    for (int c = 0; c < channels; ++c) sum += ssim_sum(a, b, weights, c, taps);
    return sum / (count * channels);
}

ImageDifference compare_images(const Image& a, const Image& b, double tolerance) {
    const double of_colours = psnr(a, b);  // refuses pictures that cannot be compared
    ImageDifference out =
        a.channels == 3 && b.channels == 4   ? compare_values(with_opaque_alpha(a), b, tolerance)
        : a.channels == 4 && b.channels == 3 ? compare_values(a, with_opaque_alpha(b), tolerance)
                                             : compare_values(a, b, tolerance);
    out.psnr = of_colours;
    out.ssim = ssim(a, b);
    return out;
}

}  // namespace ewa
