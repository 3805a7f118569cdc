// SPDX-License-Identifier: Apache-2.0
#include "image/encode.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "ewa/error.h"
#include "image/openimageio.h"

namespace ewa::image {

std::vector<unsigned char> encode_png(const Image& image) {
    std::vector<uint8_t> rounded(image.pixels.size());
    // Written so that NaN becomes 0.
    std::transform(image.pixels.begin(), image.pixels.end(), rounded.begin(), [](float v) {
        return v > 0.0f ? static_cast<uint8_t>(std::lround(std::min(v, 1.0f) * 255.0f)) : uint8_t(0);
    });
    OpenImageIO& encoder = openimageio();
    try {
        return encoder.encode_png(image.width, image.height, image.channels, rounded.data());
    } catch (const std::runtime_error& error) {
        throw RunError(error.what());
    }
}

std::vector<unsigned char> encode_exr(const Image& image) {
    OpenImageIO& encoder = openimageio();
    try {
        return encoder.encode_exr(image.width, image.height, image.channels, image.pixels.data());
    } catch (const std::runtime_error& error) {
        throw RunError(error.what());
    }
}

}  // namespace ewa::image
