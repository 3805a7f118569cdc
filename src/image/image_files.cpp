// SPDX-License-Identifier: Apache-2.0
// Pictures on disk, through OpenImageIO and libpng.
#include <new>
#include <stdexcept>

#include "core/atomic_file.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/image.h"
#include "image/encode.h"
#include "image/format.h"
#include "image/openimageio.h"
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

/// Through OpenImageIO, for every format but PNG.
image::StoredPicture read_by_openimageio(const std::filesystem::path& path, image::Format format,
                                         bool pixels) {
    image::OpenImageIO& reader = image::openimageio();
    try {
        return reader.read(path.string(), format, pixels);
    } catch (const std::runtime_error& error) {
        fail(path, error.what());
    }
}

image::StoredPicture read_file(const std::filesystem::path& path, bool pixels) try {
    const image::Format format = checked_format(path, pixels);
    image::StoredPicture out;
    if (format == image::Format::png) {
        image::PngPicture png = image::read_png(path, pixels);
        out = {png.size, png.channels, std::move(png.values)};
    } else {
        out = read_by_openimageio(path, format, pixels);
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
    image::StoredPicture stored = read_file(path, true);
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
