// SPDX-License-Identifier: Apache-2.0
// Pictures on disk, through OpenImageIO.
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <new>

#include "core/atomic_file.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/image.h"
#include "image/encode.h"
#include "image/integrity.h"

namespace ewa {

namespace {

// A picture this large has to have a file that could hold it: what formats compress best (a single colour)
// stays under this ratio, and a damaged header does not make gigabytes be taken.
constexpr uint64_t kUncheckedBytes = uint64_t(256) << 20;
constexpr uint64_t kMaxCompression = 5000;

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& reason) {
    throw InputError(core::one_line(path.string() + ": not a readable image: " + reason));
}

/// whole: the pixels will be read too, so they have to be there.
std::unique_ptr<OIIO::ImageInput> open_image(const std::filesystem::path& path, bool whole) {
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    if (!std::filesystem::exists(status)) fail(path, "there is no such file");
    if (!std::filesystem::is_regular_file(status)) fail(path, "it is not a regular file");
    image::check_png(path, whole);
    if (whole) image::check_jpeg(path);
    // Colour stays as the file has it; OpenImageIO would multiply it by alpha.
    OIIO::ImageSpec request;
    request.attribute("oiio:UnassociatedAlpha", 1);
    auto input = OIIO::ImageInput::open(path.string(), &request);
    if (!input) fail(path, OIIO::geterror());
    const OIIO::ImageSpec& spec = input->spec();
    if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.nchannels < 1)
        fail(path, "it is not a two-dimensional picture");
    const double bytes = double(spec.width) * spec.height * spec.nchannels * sizeof(float);
    const double file_bytes = double(std::filesystem::file_size(path, error));
    if (bytes > double(kUncheckedBytes) && bytes > file_bytes * kMaxCompression)
        fail(path, "its header claims " + std::to_string(spec.width) + " x " + std::to_string(spec.height) +
                       " pixels, too many for its " + std::to_string(int64_t(file_bytes)) + " bytes");
    return input;
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

}  // namespace

ImageSize read_image_size(const std::filesystem::path& path) {
    const auto input = open_image(path, false);
    const OIIO::ImageSpec& spec = input->spec();
    const int orientation = spec.get_int_attribute("Orientation", 1);
    return {spec.width, spec.height, orientation >= 1 && orientation <= 8 ? orientation : 1,
            spec.format == OIIO::TypeDesc::UINT8};
}

Image load_image(const std::filesystem::path& path) try {
    const auto input = open_image(path, true);
    const OIIO::ImageSpec& spec = input->spec();
    // Grey, grey and alpha, RGB, RGBA; whatever else a file has (depth, ids) is not colour.
    const bool grey = spec.nchannels < 3;
    const int colors = grey ? 1 : 3;
    const bool alpha = spec.nchannels > colors && spec.alpha_channel == colors;
    const int stored = colors + (alpha ? 1 : 0);
    std::vector<float> values = read_channels(*input, stored, path);

    Image image;
    image.width = spec.width;
    image.height = spec.height;
    image.channels = alpha ? 4 : 3;
    if (!grey) {
        image.pixels = std::move(values);
        return image;
    }
    const size_t count = size_t(image.width) * size_t(image.height);
    image.pixels.resize(count * size_t(image.channels));
    for (size_t i = 0; i < count; ++i) {
        float* pixel = &image.pixels[i * size_t(image.channels)];
        pixel[0] = pixel[1] = pixel[2] = values[i * size_t(stored)];
        if (alpha) pixel[3] = values[i * size_t(stored) + 1];
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
