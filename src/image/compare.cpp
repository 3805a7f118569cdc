// SPDX-License-Identifier: Apache-2.0
// How far apart two pictures are, by OpenImageIO's comparison.
#include <algorithm>
#include <cmath>
#include <limits>

#include "ewa/image.h"
#include "image/openimageio.h"

namespace ewa {
namespace {

Image with_opaque_alpha(const Image& image) {
    Image result(image.width, image.height, 4);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            std::copy_n(image.at(x, y), 3, result.at(x, y));
            result.at(x, y)[3] = 1;
        }
    return result;
}

bool same(float a, float b) {
    return a == b || (std::isnan(a) && std::isnan(b));
}

/// What OpenImageIO's comparison leaves out: values of which one or both are not finite, and RMS over them.
void add_unclamped(const Image& a, const Image& b, ImageDifference& out) {
    double sum = 0;
    for (size_t i = 0; i < a.pixels.size(); ++i) {
        const float va = a.pixels[i], vb = b.pixels[i];
        if (same(va, vb)) continue;
        const double difference = double(va) - double(vb);
        sum += difference * difference;
        if (std::isfinite(difference) || std::isinf(out.max_error)) continue;
        const size_t pixel = i / size_t(a.channels);
        out.max_error = std::numeric_limits<double>::infinity();
        out.max_x = int(pixel % size_t(a.width));
        out.max_y = int(pixel / size_t(a.width));
        out.max_channel = int(i % size_t(a.channels));
    }
    out.rms_error = std::sqrt(sum / double(a.pixels.size()));
}

/// All values; a and b have the same channels.
ImageDifference compare_values(const Image& a, const Image& b, double tolerance) {
    ImageDifference out = image::openimageio().compare(a, b, tolerance);
    add_unclamped(a, b, out);
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
