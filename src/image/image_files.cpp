// SPDX-License-Identifier: Apache-2.0
// Pictures on disk, through OpenImageIO and libpng.
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <new>
#include <stdexcept>

#include "core/atomic_file.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/image.h"
#include "image/encode.h"
#include "image/format.h"
#include "image/png_file.h"

namespace ewa {

namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& reason) {
    throw InputError(core::one_line(path.string() + ": not a readable image: " + reason));
}

/// The format, once the file's structure has been looked at.
image::Format checked_format(const std::filesystem::path& path, bool whole) {
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    if (!std::filesystem::exists(status)) fail(path, "there is no such file");
    if (!std::filesystem::is_regular_file(status)) fail(path, "it is not a regular file");
    core::FileReader reader(path);
    const image::Format format = image::format_of(reader);
    image::look_at(reader, format, whole);
    return format;
}

/// Through OpenImageIO, by the format's name: from the file's it would choose the reader by extension.
std::unique_ptr<OIIO::ImageInput> open_image(const std::filesystem::path& path, image::Format format) {
    static const bool limited = OIIO::attribute("limits:imagesize_MB", int(image::kMaxDecodedBytes >> 20)) &&
                                OIIO::attribute("limits:channels", int(image::kMaxChannels));
    if (!limited) throw RunError("OpenImageIO has no limits of pictures' sizes");
    auto input = OIIO::ImageInput::create(image::plugin_of(format));
    if (!input) fail(path, OIIO::geterror());
    // Colour stays as the file has it; OpenImageIO would multiply it by alpha.
    OIIO::ImageSpec request, spec;
    request.attribute("oiio:UnassociatedAlpha", 1);
    if (!input->open(path.string(), spec, request)) fail(path, input->geterror());
    if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.nchannels < 1 || spec.deep)
        fail(path, "it is not a two-dimensional picture");
    if (format == image::Format::webp && spec.nchannels != 3)
        fail(path, "the WebP is transparent; convert it to PNG");
    return input;
}

/// What OpenImageIO says of a picture that it has read nevertheless. libjpeg fills what it cannot decode with
/// grey and only warns; bytes too many between two markers, which cameras leave, cost no pixel.
void check_complaints(OIIO::ImageInput& input, image::Format format, const std::filesystem::path& path) {
    if (!input.has_error()) return;
    const std::string text = input.geterror();
    const auto says = [&](const char* words) { return text.find(words) != std::string::npos; };
    if (format == image::Format::jpeg && !says("Premature end") &&
        (!says("Corrupt JPEG data") || says("extraneous bytes")))
        return;
    fail(path, text);
}

/// The first `channels` channels, as float. Integers are divided by their largest value, rounded once.
std::vector<float> read_channels(OIIO::ImageInput& input, int channels, const std::filesystem::path& path) {
    const OIIO::ImageSpec& spec = input.spec();
    const size_t count = size_t(spec.width) * size_t(spec.height) * size_t(channels);
    std::vector<float> values(count);
    const auto read = [&](OIIO::TypeDesc type, void* into) {
        if (!input.read_image(0, 0, 0, channels, type, into)) fail(path, input.geterror());
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

/// Pixels as a file has them: grey, grey and alpha, RGB, or RGBA.
struct Stored {
    ImageSize size;
    int channels = 0;
    std::vector<float> values;
};

Stored read_file(const std::filesystem::path& path, bool pixels) try {
    const image::Format format = checked_format(path, pixels);
    Stored out;
    if (format == image::Format::png) {
        image::PngPicture png = image::read_png(path, pixels);
        out = {png.size, png.channels, std::move(png.values)};
    } else {
        const auto input = open_image(path, format);
        const OIIO::ImageSpec& spec = input->spec();
        out.size = {spec.width, spec.height, spec.get_int_attribute("Orientation", 1),
                    spec.format == OIIO::TypeDesc::UINT8};
        // Whatever else a file has (depth, ids) is not colour.
        const int colors = spec.nchannels < 3 ? 1 : 3;
        const bool alpha = spec.nchannels > colors && spec.alpha_channel == colors;
        out.channels = colors + (alpha ? 1 : 0);
        if (pixels) out.values = read_channels(*input, out.channels, path);
        check_complaints(*input, format, path);
    }
    if (out.size.orientation < 1 || out.size.orientation > 8) out.size.orientation = 1;
    return out;
} catch (const std::bad_alloc&) {
    fail(path, "it is too large for this machine's memory");
} catch (const std::length_error&) {
    fail(path, "its header claims more than memory can hold");
}

}  // namespace

ImageSize read_image_size(const std::filesystem::path& path) {
    return read_file(path, false).size;
}

Image load_image(const std::filesystem::path& path) try {
    Stored stored = read_file(path, true);
    const bool alpha = stored.channels % 2 == 0;
    Image image;
    image.width = stored.size.width;
    image.height = stored.size.height;
    image.channels = alpha ? 4 : 3;
    if (stored.channels >= 3) {
        image.pixels = std::move(stored.values);
        return image;
    }
    const size_t count = size_t(image.width) * size_t(image.height);
    image.pixels.resize(count * size_t(image.channels));
    for (size_t i = 0; i < count; ++i) {
        float* pixel = &image.pixels[i * size_t(image.channels)];
        pixel[0] = pixel[1] = pixel[2] = stored.values[i * size_t(stored.channels)];
        if (alpha) pixel[3] = stored.values[i * size_t(stored.channels) + 1];
    }
    return image;
} catch (const std::bad_alloc&) {
    fail(path, "it is too large for this machine's memory");
}

void save_image(const std::filesystem::path& path, const Image& image) {
    const std::string extension = core::lower(path.extension().string());
    if (extension != ".png" && extension != ".exr")
        throw InputError(core::one_line(path.string() + ": pictures are written as .png or .exr"));
    if (image.width < 1 || image.height < 1 || image.channels < 1)
        throw InputError(core::one_line(path.string() + ": a picture without pixels cannot be written"));
    // Encoded in memory and written by AtomicFile, which sees a full disk where the codecs' own writers may
    // not.
    std::vector<unsigned char> bytes;
    try {
        bytes = extension == ".exr" ? image::encode_exr(image) : image::encode_png(image);
    } catch (const RunError& error) {
        throw RunError(core::one_line(path.string() + ": " + error.what()));
    }
    core::AtomicFile file(path);
    file.write(bytes.data(), bytes.size());
    file.commit();
}

}  // namespace ewa
