// SPDX-License-Identifier: Apache-2.0
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <stdexcept>
#include <string_view>

#include "openimageio/functions.h"

namespace ewa::openimageio {
namespace {

std::vector<unsigned char> encode(OIIO::ImageSpec spec, const char* format, const void* values) {
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    const std::string name = std::string("picture.") + format;
    auto output = OIIO::ImageOutput::create(name);
    if (!output) throw std::runtime_error("cannot be written: " + OIIO::geterror());
    // Colour stays as it is; OpenImageIO would divide it by alpha.
    spec.attribute("oiio:UnassociatedAlpha", 1);
    // OpenImageIO would put the time of day in: the same picture is to be the same bytes.
    if (std::string_view(format) == "exr") spec.attribute("DateTime", "1970:01:01 00:00:00");
    OIIO::Filesystem::IOProxy* proxy = &memory;
    spec.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    if (!output->open(name, spec) || !output->write_image(spec.format, values) || !output->close())
        throw std::runtime_error("cannot be encoded: " + output->geterror());
    return bytes;
}

}  // namespace

std::vector<unsigned char> encode_png(int width, int height, int channels, const uint8_t* values) {
    return encode({width, height, channels, OIIO::TypeDesc::UINT8}, "png", values);
}

std::vector<unsigned char> encode_exr(int width, int height, int channels, const float* values) {
    return encode({width, height, channels, OIIO::TypeDesc::FLOAT}, "exr", values);
}

}  // namespace ewa::openimageio
