// SPDX-License-Identifier: Apache-2.0
// How far apart two pictures are, by OpenImageIO's comparison.
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>

#include "ewa/image.h"

namespace ewa {
namespace {

/// Looks at the picture's own memory; OpenImageIO does not write to what it only compares.
OIIO::ImageBuf view_of(const Image& image) {
    const OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::FLOAT);
    return OIIO::ImageBuf(spec, const_cast<float*>(image.pixels.data()));
}

}  // namespace

ImageDifference compare_images(const Image& a, const Image& b, double tolerance) {
    ImageDifference out;
    out.psnr = psnr(a, b);  // refuses pictures that cannot be compared
    out.ssim = ssim(a, b);
    const OIIO::ROI both(0, a.width, 0, a.height, 0, 1, 0, std::min(a.channels, b.channels));
    const float limit = float(tolerance);
    const auto found = OIIO::ImageBufAlgo::compare(view_of(a), view_of(b), limit, limit, 0.0f, 0.0f, both, 1);
    out.max_error = found.maxerror;
    out.max_x = found.maxx;
    out.max_y = found.maxy;
    out.max_channel = found.maxc;
    out.mean_error = found.meanerror;
    out.rms_error = found.rms_error;
    out.over = found.nfail;
    return out;
}

}  // namespace ewa
