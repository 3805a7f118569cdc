// SPDX-License-Identifier: Apache-2.0
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include "openimageio/functions.h"

namespace ewa::openimageio {
namespace {

/// Looks at the picture's own memory; OpenImageIO does not write to what it only compares.
OIIO::ImageBuf view_of(const Image& image) {
    const OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::FLOAT);
    return OIIO::ImageBuf(spec, const_cast<float*>(image.pixels.data()));
}

}  // namespace

ImageDifference compare(const Image& a, const Image& b, double tolerance) {
    const OIIO::ROI all(0, a.width, 0, a.height, 0, 1, 0, a.channels);
    const float limit = float(tolerance);
    const auto found = OIIO::ImageBufAlgo::compare(view_of(a), view_of(b), limit, limit, 0.0f, 0.0f, all, 1);
    ImageDifference out;
    out.max_error = found.maxerror;
    out.max_x = found.maxx;
    out.max_y = found.maxy;
    out.max_channel = found.maxc;
    out.mean_error = found.meanerror;
    out.over = found.nfail;
    return out;
}

}  // namespace ewa::openimageio
