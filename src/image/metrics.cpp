// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "ewa/error.h"
#include "ewa/image.h"
#include "image/metric.h"

namespace ewa {

namespace image {

int compared_channels(const Image& a, const Image& b) {
    check(a);
    check(b);
    const int channels = std::min(a.channels, 3);
    if (a.width != b.width || a.height != b.height || channels != std::min(b.channels, 3) || a.pixels.empty())
        throw InputError("pictures of " + std::to_string(a.width) + " x " + std::to_string(a.height) + " x " +
                         std::to_string(a.channels) + " and " + std::to_string(b.width) + " x " +
                         std::to_string(b.height) + " x " + std::to_string(b.channels) +
                         " cannot be compared");
    return channels;
}

double weight_sum(const Image& weights, const Image& image) {
    check(weights);
    if (weights.pixels.empty()) return double(image.width) * image.height;
    if (weights.width != image.width || weights.height != image.height || weights.channels != 1)
        throw InputError("the weights of a picture have another size");
    double sum = 0;
    for (const float weight : weights.pixels) sum += double(weight);
    return sum;
}

Image pulled_onto(const Image& a, const Image& b, const Image& weights) {
    if (weights.pixels.empty()) return a;
    Image result(a.width, a.height, std::min(a.channels, 3));
    for (int y = 0; y < a.height; ++y)
        for (int x = 0; x < a.width; ++x)
            for (int c = 0; c < result.channels; ++c) {
                const float weight = *weights.at(x, y);
                result.at(x, y)[c] = weight * a.at(x, y)[c] + (1 - weight) * b.at(x, y)[c];
            }
    return result;
}

}  // namespace image

namespace {

double clamped(float value) {
    return std::clamp(double(value), 0.0, 1.0);
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
    const int channels = image::compared_channels(a, b);
    const double count = image::weight_sum(weights, a);
    double sum = 0;
    for (int y = 0; y < a.height; ++y)
        for (int x = 0; x < a.width; ++x)
            for (int c = 0; c < channels; ++c) {
                const double difference = clamped(a.at(x, y)[c]) - clamped(b.at(x, y)[c]);
                sum += image::weight_at(weights, x, y) * difference * difference;
            }
    if (count == 0) return std::numeric_limits<double>::quiet_NaN();
    if (sum == 0) return std::numeric_limits<double>::infinity();
    return -10 * std::log10(sum / (count * channels));
}

ImageDifference compare_images(const Image& a, const Image& b, double tolerance) {
    const double of_colours = psnr(a, b);  // refuses images that cannot be compared
    if (a.channels != b.channels && std::max(a.channels, b.channels) > 4)
        throw InputError("images of " + std::to_string(a.channels) + " and " + std::to_string(b.channels) +
                         " channels cannot be compared");
    ImageDifference out =
        a.channels == 3 && b.channels == 4   ? compare_values(with_opaque_alpha(a), b, tolerance)
        : a.channels == 4 && b.channels == 3 ? compare_values(a, with_opaque_alpha(b), tolerance)
                                             : compare_values(a, b, tolerance);
    out.psnr = of_colours;
    out.ssim = ssim(a, b);
    return out;
}

}  // namespace ewa
