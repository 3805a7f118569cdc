// SPDX-License-Identifier: Apache-2.0
// The module that src/image/openimageio.cpp loads: OpenImageIO behind the functions of image/image_files.h.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "image/image_files.h"
#include "platform/exported.h"

namespace {

using ewa::Image;
using ewa::image::ImageHeader;
using ewa::image::OpenImageIO;
using ewa::image::StoredImage;

[[noreturn]] void fail(const std::string& reason) {
    throw std::runtime_error(reason);
}

bool limit(uint64_t decoded_bytes, uint64_t channels) {
    // No threads of OpenEXR. Its library waits at exit until they have begun, when Windows has already ended them.
    OIIO::attribute("exr_threads", -1);
    return OIIO::attribute("limits:imagesize_MB", int(decoded_bytes >> 20)) &&
           OIIO::attribute("limits:channels", int(channels));
}

/// The first `channels` channels. Integers are divided by their largest value and rounded once.
std::vector<float> read_values(OIIO::ImageInput& input, int channels) {
    const OIIO::ImageSpec& spec = input.spec();
    std::vector<float> values(size_t(spec.width) * size_t(spec.height) * size_t(channels));
    const auto read_integers = [&](auto zero, OIIO::TypeDesc type, float largest) {
        std::vector<decltype(zero)> integers(values.size());
        if (!input.read_image(0, 0, 0, channels, type, integers.data())) fail(input.geterror());
        std::transform(integers.begin(), integers.end(), values.begin(),
                       [=](auto v) { return float(v) / largest; });
    };
    if (spec.format == OIIO::TypeDesc::UINT8)
        read_integers(uint8_t(0), OIIO::TypeDesc::UINT8, 255.0f);
    else if (spec.format == OIIO::TypeDesc::UINT16)
        read_integers(uint16_t(0), OIIO::TypeDesc::UINT16, 65535.0f);
    else if (!input.read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, values.data()))
        fail(input.geterror());
    return values;
}

StoredImage read(const std::string& path, const std::string& reader, bool pixels,
                 const std::function<void(const ImageHeader&)>& check) {
    // By the reader's name: OpenImageIO would choose one by the file's extension.
    const auto input = OIIO::ImageInput::create(reader);
    if (!input) fail(OIIO::geterror());
    // Colour stays as the file has it. OpenImageIO would multiply it by alpha.
    OIIO::ImageSpec request, spec;
    request.attribute("oiio:UnassociatedAlpha", 1);
    if (!input->open(path, spec, request)) fail(input->geterror());
    if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.nchannels < 1 || spec.deep)
        fail("it is not a two-dimensional picture");
    check({uint64_t(spec.width), uint64_t(spec.height), uint64_t(spec.nchannels), spec.format.size()});
    if (reader == "webp" && spec.nchannels != 3) fail("the WebP is transparent; convert it to PNG");
    StoredImage out;
    out.size = {spec.width, spec.height, spec.get_int_attribute("Orientation", 1),
                spec.format == OIIO::TypeDesc::UINT8};
    // In an HDR this is the order of the rows and columns, and not EXIF's.
    if (reader == "hdr" && out.size.orientation != 1)
        fail("the HDR's size is not written as -Y height +X width");
    // Other channels, depth for example, are not colour.
    const int colors = spec.nchannels < 3 ? 1 : 3;
    out.channels = colors + (spec.nchannels > colors && spec.alpha_channel == colors ? 1 : 0);
    if (pixels) out.values = read_values(*input, out.channels);
    // OpenImageIO reports damage also for images that it has read to the end.
    if (input->has_error()) fail(input->geterror());
    return out;
}

std::vector<unsigned char> encode_exr(const Image& image) {
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    OIIO::Filesystem::IOProxy* proxy = &memory;
    OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::FLOAT);
    // OpenImageIO would write the time of day. The same image must give the same bytes.
    spec.attribute("DateTime", "1970:01:01 00:00:00");
    spec.attribute("oiio:UnassociatedAlpha", 1);
    spec.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    const auto output = OIIO::ImageOutput::create("picture.exr");
    if (!output) fail("cannot be written: " + OIIO::geterror());
    if (!output->open("picture.exr", spec) || !output->write_image(spec.format, image.pixels.data()) ||
        !output->close())
        fail("cannot be encoded: " + output->geterror());
    return bytes;
}

bool reads_heif() {
    return OIIO::ImageInput::create("heif") != nullptr;
}

void jpeg_of_heif(const std::string& heif, const std::string& jpeg,
                  const std::function<void(const ImageHeader&)>& check) {
    constexpr int kQuality = 95;
    const auto input = OIIO::ImageInput::create("heif");
    OIIO::ImageSpec spec;
    if (!input) fail(OIIO::geterror());
    if (!input->open(heif, spec)) fail(input->geterror());
    check({uint64_t(spec.width), uint64_t(spec.height), uint64_t(spec.nchannels), spec.format.size()});
    const int channels = spec.nchannels < 3 ? 1 : 3;
    std::vector<uint8_t> pixels(size_t(spec.width) * size_t(spec.height) * size_t(channels));
    if (!input->read_image(0, 0, 0, channels, OIIO::TypeDesc::UINT8, pixels.data())) fail(input->geterror());
    spec.nchannels = channels;
    spec.alpha_channel = -1;
    spec.set_format(OIIO::TypeDesc::UINT8);
    spec.attribute("Compression", "jpeg:" + std::to_string(kQuality));
    const auto output = OIIO::ImageOutput::create(jpeg);
    if (!output) fail(OIIO::geterror());
    if (!output->open(jpeg, spec) || !output->write_image(spec.format, pixels.data()) || !output->close())
        fail(output->geterror());
}

}  // namespace

extern "C" EWA_EXPORTED const OpenImageIO ewa_openimageio_layout_2;
const OpenImageIO ewa_openimageio_layout_2 = {EWA_VERSION, limit, read, encode_exr, reads_heif, jpeg_of_heif};
