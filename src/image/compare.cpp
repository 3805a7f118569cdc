// SPDX-License-Identifier: Apache-2.0
// How far apart two pictures are, by OpenImageIO's comparison.
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "ewa/image.h"

namespace ewa {
namespace {

/// Looks at the picture's own memory; OpenImageIO does not write to what it only compares.
OIIO::ImageBuf view_of(const Image& image) {
    const OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::FLOAT);
    return OIIO::ImageBuf(spec, const_cast<float*>(image.pixels.data()));
}

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
void compare_values(const Image& a, const Image& b, double tolerance, ImageDifference& out) {
    const OIIO::ROI all(0, a.width, 0, a.height, 0, 1, 0, a.channels);
    const float limit = float(tolerance);
    const auto found = OIIO::ImageBufAlgo::compare(view_of(a), view_of(b), limit, limit, 0.0f, 0.0f, all, 1);
    out.max_error = found.maxerror;
    out.max_x = found.maxx;
    out.max_y = found.maxy;
    out.max_channel = found.maxc;
    out.mean_error = found.meanerror;
    out.over = found.nfail;
    add_unclamped(a, b, out);
}

}  // namespace

ImageDifference compare_images(const Image& a, const Image& b, double tolerance) {
    ImageDifference out;
    out.psnr = psnr(a, b);  // refuses pictures that cannot be compared
    out.ssim = ssim(a, b);
    if (a.channels == 3 && b.channels == 4)
        compare_values(with_opaque_alpha(a), b, tolerance, out);
    else if (a.channels == 4 && b.channels == 3)
        compare_values(a, with_opaque_alpha(b), tolerance, out);
    else
        compare_values(a, b, tolerance, out);
    return out;
}

}  // namespace ewa
