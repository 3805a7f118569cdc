// SPDX-License-Identifier: Apache-2.0
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <stdexcept>

#include "openimageio/functions.h"

namespace ewa::openimageio {
namespace {

using image::Format;

[[noreturn]] void fail(const std::string& reason) {
    throw std::runtime_error(reason);
}

const char* plugin_of(Format format) {
    switch (format) {
        case Format::png:
            return "png";
        case Format::jpeg:
            return "jpeg";
        case Format::tiff:
            return "tiff";
        case Format::exr:
            return "openexr";
        case Format::webp:
            return "webp";
        case Format::bmp:
            return "bmp";
        case Format::pnm:
            return "pnm";
        case Format::hdr:
            return "hdr";
    }
    return "";
}

/// By the format's name: from the file's OpenImageIO would choose the reader by extension.
std::unique_ptr<OIIO::ImageInput> open_image(const std::string& path, Format format) {
    auto input = OIIO::ImageInput::create(plugin_of(format));
    if (!input) fail(OIIO::geterror());
    // Colour stays as the file has it; OpenImageIO would multiply it by alpha.
    OIIO::ImageSpec request, spec;
    request.attribute("oiio:UnassociatedAlpha", 1);
    if (!input->open(path, spec, request)) fail(input->geterror());
    if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.nchannels < 1 || spec.deep)
        fail("it is not a two-dimensional picture");
    if (format == Format::webp && spec.nchannels != 3) fail("the WebP is transparent; convert it to PNG");
    return input;
}

/// What OpenImageIO says of a picture that it has read nevertheless. libjpeg fills what it cannot decode with
/// grey and only warns; bytes too many between two markers, which cameras leave, cost no pixel.
void check_complaints(OIIO::ImageInput& input, Format format) {
    if (!input.has_error()) return;
    const std::string text = input.geterror();
    const auto says = [&](const char* words) { return text.find(words) != std::string::npos; };
    if (format == Format::jpeg && !says("Premature end") &&
        (!says("Corrupt JPEG data") || says("extraneous bytes")))
        return;
    fail(text);
}

/// The first `channels` channels, as float. Integers are divided by their largest value, rounded once.
std::vector<float> read_channels(OIIO::ImageInput& input, int channels) {
    const OIIO::ImageSpec& spec = input.spec();
    const size_t count = size_t(spec.width) * size_t(spec.height) * size_t(channels);
    std::vector<float> values(count);
    const auto read = [&](OIIO::TypeDesc type, void* into) {
        if (!input.read_image(0, 0, 0, channels, type, into)) fail(input.geterror());
    };
    if (spec.format == OIIO::TypeDesc::UINT8) {
        std::vector<uint8_t> bytes(count);
        read(OIIO::TypeDesc::UINT8, bytes.data());
        std::transform(bytes.begin(), bytes.end(), values.begin(),
                       [](uint8_t v) { return float(v) / 255.0f; });
    } else if (spec.format == OIIO::TypeDesc::UINT16) {
        std::vector<uint16_t> words(count);
        read(OIIO::TypeDesc::UINT16, words.data());
        std::transform(words.begin(), words.end(), values.begin(),
                       [](uint16_t v) { return float(v) / 65535.0f; });
    } else {
        read(OIIO::TypeDesc::FLOAT, values.data());
    }
    return values;
}

}  // namespace

image::StoredPicture read(const std::string& path, Format format, bool pixels) {
    const auto input = open_image(path, format);
    const OIIO::ImageSpec& spec = input->spec();
    image::StoredPicture out;
    out.size = {spec.width, spec.height, spec.get_int_attribute("Orientation", 1),
                spec.format == OIIO::TypeDesc::UINT8};
    // Whatever else a file has (depth, ids) is not colour.
    const int colors = spec.nchannels < 3 ? 1 : 3;
    const bool alpha = spec.nchannels > colors && spec.alpha_channel == colors;
    out.channels = colors + (alpha ? 1 : 0);
    if (pixels) out.values = read_channels(*input, out.channels);
    check_complaints(*input, format);
    return out;
}

}  // namespace ewa::openimageio
