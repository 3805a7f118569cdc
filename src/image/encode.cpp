// SPDX-License-Identifier: Apache-2.0
#include "image/encode.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>

#include "ewa/error.h"

namespace ewa::image {
namespace {

std::vector<unsigned char> encode(const Image& image, const char* format, OIIO::TypeDesc type,
                                  const void* pixels) {
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    const std::string name = std::string("picture.") + format;
    auto output = OIIO::ImageOutput::create(name);
    if (!output) throw RunError("cannot be written: " + OIIO::geterror());
    OIIO::ImageSpec spec(image.width, image.height, image.channels, type);
    // Colour stays as it is; OpenImageIO would divide it by alpha.
    spec.attribute("oiio:UnassociatedAlpha", 1);
    // OpenImageIO would put the time of day in: the same picture is to be the same bytes.
    if (std::string_view(format) == "exr") spec.attribute("DateTime", "1970:01:01 00:00:00");
    OIIO::Filesystem::IOProxy* proxy = &memory;
    spec.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    if (!output->open(name, spec) || !output->write_image(type, pixels) || !output->close())
        throw RunError("cannot be encoded: " + output->geterror());
    return bytes;
}

}  // namespace

std::vector<unsigned char> encode_png(const Image& image) {
    std::vector<uint8_t> rounded(image.pixels.size());
    // Written so that NaN becomes 0.
    std::transform(image.pixels.begin(), image.pixels.end(), rounded.begin(), [](float v) {
        return v > 0.0f ? static_cast<uint8_t>(std::lround(std::min(v, 1.0f) * 255.0f)) : uint8_t(0);
    });
    return encode(image, "png", OIIO::TypeDesc::UINT8, rounded.data());
}

std::vector<unsigned char> encode_exr(const Image& image) {
    return encode(image, "exr", OIIO::TypeDesc::FLOAT, image.pixels.data());
}

}  // namespace ewa::image
