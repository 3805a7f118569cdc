// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "image/metric.h"
#include "shared/constants.h"

namespace ewa {

namespace {

constexpr int kRadius = static_cast<int>(shared::SSIM_RADIUS);
constexpr int kTaps = 2 * kRadius + 1;

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

/// SSIM without the factor that compares the means.
double contrast_of(const Moments& m, size_t x) {
    const double variances = m[2][x] + m[3][x] - m[0][x] * m[0][x] - m[1][x] * m[1][x];
    return (2 * (m[4][x] - m[0][x] * m[1][x]) + shared::SSIM_C2) / (variances + shared::SSIM_C2);
}

void clear(Moments& moments, int width) {
    for (auto& moment : moments) moment.assign(size_t(width), 0.0);
}

/// A row of one channel of both images, with zeros beyond its ends.
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

void read_rows(const Image& a, const Image& b, int y, int channel, Rows& rows) {
    for (int x = 0; x < a.width; ++x) {
        rows.a[size_t(x + kRadius)] = std::clamp(double(a.at(x, y)[channel]), 0.0, 1.0);
        rows.b[size_t(x + kRadius)] = std::clamp(double(b.at(x, y)[channel]), 0.0, 1.0);
    }
}

/// Calls at(x, y, moments) for each pixel of a channel. Only the rows under the window are in memory, however tall the
/// image.
template <class At>
void for_windows(const Image& a, const Image& b, int channel, const std::array<double, kTaps>& taps,
                 const At& at) {
    std::array<Moments, kTaps> blurred_rows;
    Moments sums;
    Rows rows{std::vector<double>(size_t(a.width + 2 * kRadius)), {}};
    rows.b = rows.a;
    int blurred = 0;
    for (int y = 0; y < a.height; ++y) {
        for (; blurred <= std::min(a.height - 1, y + kRadius); ++blurred) {
            read_rows(a, b, blurred, channel, rows);
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
        for (int x = 0; x < a.width; ++x) at(x, y, sums);
    }
}

/// Means of SSIM and of its contrast over the pixels whose whole window is in the image.
struct ValidMeans {
    double ssim = 0, contrast = 0;
};

ValidMeans valid_means(const Image& a, const Image& b, const Image& weights, int channels) {
    const std::array<double, kTaps> taps = window();
    double ssim = 0, contrast = 0, count = 0;
    for (int c = 0; c < channels; ++c)
        for_windows(a, b, c, taps, [&](int x, int y, const Moments& moments) {
            if (x < kRadius || y < kRadius || x >= a.width - kRadius || y >= a.height - kRadius) return;
            const double weight = image::weight_at(weights, x, y);
            ssim += weight * ssim_of(moments, size_t(x));
            contrast += weight * contrast_of(moments, size_t(x));
            count += weight;
        });
    if (count == 0) return {std::numeric_limits<double>::quiet_NaN(), 0};
    return {ssim / count, contrast / count};
}

/// Means of 2 x 2 pixels, without an odd last row or column.
Image halved(const Image& image) {
    Image result(image.width / 2, image.height / 2, image.channels);
    for (int y = 0; y < result.height; ++y)
        for (int x = 0; x < result.width; ++x)
            for (int c = 0; c < image.channels; ++c)
                result.at(x, y)[c] = float(
                    (double(image.at(2 * x, 2 * y)[c]) + double(image.at(2 * x + 1, 2 * y)[c]) +
                     double(image.at(2 * x, 2 * y + 1)[c]) + double(image.at(2 * x + 1, 2 * y + 1)[c])) /
                    4);
    return result;
}

Image clamped_rgb(const Image& image, int channels) {
    Image result(image.width, image.height, channels);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            for (int c = 0; c < channels; ++c) result.at(x, y)[c] = std::clamp(image.at(x, y)[c], 0.0f, 1.0f);
    return result;
}

}  // namespace

double ssim(const Image& a, const Image& b, const Image& weights) {
    const int channels = image::compared_channels(a, b);
    const double count = image::weight_sum(weights, a);
    const std::array<double, kTaps> taps = window();
    const Image pulled = weights.pixels.empty() ? Image() : image::pulled_onto(a, b, weights);
    double total = 0;
    for (int c = 0; c < channels; ++c) {
        double sum = 0;
        for_windows(weights.pixels.empty() ? a : pulled, b, c, taps,
                    [&](int x, int y, const Moments& moments) {
                        sum += image::weight_at(weights, x, y) * ssim_of(moments, size_t(x));
                    });
        total += sum;
    }
    return total / (count * channels);
}

namespace image {

double ssim_valid(const Image& a, const Image& b, const Image& weights) {
    const int channels = compared_channels(a, b);
    weight_sum(weights, a);  // refuses weights of another size
    return valid_means(pulled_onto(a, b, weights), b, weights, channels).ssim;
}

double ms_ssim(const Image& a, const Image& b, const Image& weights) {
    constexpr std::array<double, 5> kExponents = {0.0448, 0.2856, 0.3001, 0.2363, 0.1333};
    constexpr int kLeastSide = kTaps << (kExponents.size() - 1);
    const int channels = compared_channels(a, b);
    weight_sum(weights, a);
    if (std::min(a.width, a.height) < kLeastSide) return std::numeric_limits<double>::quiet_NaN();
    Image first = clamped_rgb(pulled_onto(a, b, weights), channels), second = clamped_rgb(b, channels);
    Image scaled_weights = weights;
    double product = 1;
    for (size_t scale = 0; scale < kExponents.size(); ++scale) {
        if (scale > 0) {
            first = halved(first);
            second = halved(second);
            if (!weights.pixels.empty()) scaled_weights = halved(scaled_weights);
        }
        const ValidMeans means = valid_means(first, second, scaled_weights, channels);
        if (std::isnan(means.ssim)) return means.ssim;
        const double factor = scale + 1 < kExponents.size() ? means.contrast : means.ssim;
        product *= std::pow(std::max(0.0, factor), kExponents[scale]);
    }
    return product;
}

}  // namespace image

}  // namespace ewa
