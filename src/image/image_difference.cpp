// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include "ewa/image.h"

namespace ewa {
namespace {

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
