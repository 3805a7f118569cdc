// SPDX-License-Identifier: Apache-2.0
#include "image/image_files.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <iterator>
#include <memory>
#include <new>
#include <stdexcept>
#include <utility>

#include "core/atomic_file.h"
#include "core/folders.h"
#include "core/system_limits.h"
#include "core/text.h"
#include "ewa/error.h"
#include "platform/file.h"

namespace ewa {

namespace {

namespace fs = std::filesystem;

struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

constexpr const char* kNotReadable = ": not a readable image: ";

/// Calls `read`. Throws InputError "name: not a readable image: reason" for any reason that it throws.
template <class Read>
auto with_name(const std::string& name, const Read& read) {
    std::string reason;
    try {
        return read();
    } catch (const InputError&) {
        throw;  // of core::FileReader, which has the name
    } catch (const RunError& error) {
        throw RunError(core::one_line(name + ": " + error.what()));
    } catch (const std::runtime_error& error) {
        reason = error.what();
    } catch (const std::bad_alloc&) {
        reason = core::address_limit_text() + "it is too large for the memory";
    } catch (const std::length_error&) {
        reason = "its header claims more than memory can hold";
    }
    throw InputError(core::one_line(name + kNotReadable + reason));
}

File open_file(const fs::path& path) {
    std::error_code error;
    // Before it is opened: opening a named pipe would wait for a writer.
    const fs::file_status status = fs::status(path, error);
    if (!fs::exists(status)) throw std::runtime_error("there is no such file");
    if (!fs::is_regular_file(status)) throw std::runtime_error("it is not a regular file");
    File file(platform::open_stream(path));
    if (!file) throw std::runtime_error(std::strerror(errno));
    return file;
}

const image::Format& format_of(std::FILE* file) {
    std::array<char, 16> bytes;
    const size_t size = std::fread(bytes.data(), 1, bytes.size(), file);
    std::rewind(file);
    if (size == 0) throw std::runtime_error("the file is empty");
    const image::Format* format = image::format_of({bytes.data(), size});
    if (!format)
        throw std::runtime_error(
            "its first bytes are none of a PNG, JPEG, TIFF, EXR, WebP, BMP, binary PPM or PGM, or Radiance "
            "HDR "
            "file; convert it to one of these");
    return *format;
}

image::StoredImage read_file(const fs::path& path, bool pixels) {
    const File file = open_file(path);
    const image::Format& format = format_of(file.get());
    const uint64_t bytes = fs::file_size(path);
    if (format.read) return format.read(file.get(), bytes, pixels);
    if (format.probe) {
        core::FileReader reader(path);
        format.probe(reader);
    }
    return image::openimageio().read(path.string(), std::string(format.name), pixels,
                                     [&](const image::ImageHeader& header) { check_limits(header, bytes); });
}

/// Grey becomes RGB.
Image with_colour(image::StoredImage stored) {
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
}

}  // namespace

ImageSize read_image_size(const fs::path& path) {
    ImageSize size = with_name(path.string(), [&] { return read_file(path, false).size; });
    if (size.orientation < 1 || size.orientation > 8) size.orientation = 1;
    return size;
}

Image load_image(const fs::path& path) {
    return with_name(path.string(), [&] { return with_colour(read_file(path, true)); });
}

namespace image {

bool reads_heif() try { return openimageio().reads_heif(); } catch (const RunError&) {
    return false;  // there is no module
}

bool write_jpeg_of_heif(const fs::path& heif, const fs::path& jpeg) try {
    const uint64_t bytes = fs::file_size(heif);
    openimageio().jpeg_of_heif(heif.string(), jpeg.string(),
                               [&](const ImageHeader& header) { check_limits(header, bytes); });
    return true;
} catch (const std::exception&) {
    return false;
}

}  // namespace image

namespace {

constexpr int kJpegQuality = 95;

Image grey_as_rgb(const Image& grey) {
    Image rgb(grey.width, grey.height, 3);
    for (size_t i = 0; i < rgb.pixels.size(); ++i) rgb.pixels[i] = grey.pixels[i / 3];
    return rgb;
}

/// xmp: empty for none.
void save(const fs::path& path, const Image& image, const std::string& xmp) {
    const std::string extension = core::lower(path.extension().string());
    const bool jpeg = extension == ".jpg" || extension == ".jpeg";
    if (extension != ".png" && extension != ".exr" && !jpeg)
        throw InputError(core::one_line(path.string() + ": pictures are written as .png, .jpg or .exr"));
    check(image);
    if (image.width < 1 || image.height < 1 || image.channels < 1)
        throw InputError(core::one_line(path.string() + ": a picture without pixels cannot be written"));
    // AtomicFile notices a full disk. The codecs' own writers may not.
    std::vector<unsigned char> bytes;
    try {
        bytes = extension == ".exr" ? image::openimageio().encode_exr(image)
                : jpeg ? image::encode_jpeg(image.channels == 1 ? grey_as_rgb(image) : image, kJpegQuality)
                       : image::encode_png(image);
        if (!xmp.empty() && extension != ".exr") bytes = image::with_xmp(std::move(bytes), xmp);
    } catch (const std::runtime_error& error) {
        throw RunError(core::one_line(path.string() + ": " + error.what()));
    }
    core::AtomicFile file(path);
    file.write(bytes.data(), bytes.size());
    file.commit();
}

}  // namespace

void save_image(const fs::path& path, const Image& image) {
    save(path, image, {});
}

void save_panorama(const fs::path& path, const Image& image) {
    save(path, image, image::panorama_xmp(image.width, image.height));
}

namespace image {

namespace {

using namespace std::string_view_literals;

// TIFF has either byte order. The version 43 instead of 42 means 64-bit offsets.
constexpr Format kFormats[] = {
    {"\x89PNG\r\n\x1a\n"sv, "png", read_png},
    {"\xff\xd8\xff"sv, "jpeg", read_jpeg},
    {"II\x2a\0"sv, "tiff", nullptr, probe_tiff},
    {"MM\0\x2a"sv, "tiff", nullptr, probe_tiff},
    {"II\x2b\0"sv, "tiff", nullptr, probe_tiff},
    {"MM\0\x2b"sv, "tiff", nullptr, probe_tiff},
    {"\x76\x2f\x31\x01"sv, "openexr", nullptr, probe_exr},
    {"RIFF"sv, "webp", nullptr, probe_webp},
    {"BM"sv, "bmp", nullptr, probe_bmp},
    {"P5"sv, "pnm", nullptr, probe_pnm},
    {"P6"sv, "pnm", nullptr, probe_pnm},
    {"#?RADIANCE"sv, "hdr"},
    {"#?RGBE"sv, "hdr"},
};

}  // namespace

const Format* format_of(std::string_view first_bytes) {
    const auto* found = std::find_if(std::begin(kFormats), std::end(kFormats), [&](const Format& format) {
        return first_bytes.starts_with(format.signature);
    });
    if (found == std::end(kFormats)) return nullptr;
    if (found->name == "webp" && (first_bytes.size() < 12 || first_bytes.substr(8, 4) != "WEBP"))
        return nullptr;
    return found;
}

void check_limits(const ImageHeader& header, uint64_t file_bytes) {
    if (header.width < 1 || header.height < 1 || header.channels < 1)
        throw std::runtime_error("its header describes a picture without pixels");
    const auto refuse = [&](const std::string& reason) {
        throw std::runtime_error("its header claims " + std::to_string(header.width) + " x " +
                                 std::to_string(header.height) + " pixels of " +
                                 std::to_string(header.channels) + " channels, " + reason);
    };
    if (header.width > kMaxSide || header.height > kMaxSide)
        refuse("more than " + std::to_string(kMaxSide) + " in a direction");
    const uint64_t pixels = header.width * header.height;
    if (pixels > kMaxPixels)
        refuse("more than " + std::to_string(kMaxPixels / 1'000'000) +
               " million pixels; make the picture smaller");
    if (header.channels > kMaxChannels ||
        pixels * header.channels * header.bytes_per_value > kMaxDecodedBytes)
        refuse("more than " + std::to_string(kMaxDecodedBytes >> 30) + " GiB or " +
               std::to_string(kMaxChannels) + " channels; keep only its colour");
    const uint64_t bytes = pixels * header.channels * sizeof(float);
    if (bytes > kUncheckedBytes && bytes / kMaxCompression > file_bytes)
        refuse("too many for its " + std::to_string(file_bytes) + " bytes");
}

uint64_t big_endian(const std::byte* bytes, int count) {
    uint64_t value = 0;
    for (int i = 0; i < count; ++i) value = value << 8 | std::to_integer<uint64_t>(bytes[i]);
    return value;
}

uint64_t little_endian(const std::byte* bytes, int count) {
    uint64_t value = 0;
    for (int i = count; i-- > 0;) value = value << 8 | std::to_integer<uint64_t>(bytes[i]);
    return value;
}

namespace {

/// The directories of an EXIF block. Numbers beyond its end are 0.
class Exif {
  public:
    Exif(const void* bytes, uint64_t size) : bytes_(static_cast<const std::byte*>(bytes)), size_(size) {}

    uint64_t number(uint64_t at, int count) const {
        if (at + uint64_t(count) > size_) return 0;
        return bytes_[0] == std::byte('M') ? big_endian(bytes_ + at, count)
                                           : little_endian(bytes_ + at, count);
    }
    uint64_t first() const { return number(4, 4); }
    /// Where the value of a tag is, which may be an offset. 0: the directory has no such tag.
    uint64_t find(uint64_t directory, uint64_t tag) const {
        constexpr uint64_t kEntryBytes = 12;
        const uint64_t count = number(directory, 2);
        for (uint64_t i = 0; i < count; ++i) {
            const uint64_t entry = directory + 2 + i * kEntryBytes;
            if (number(entry, 2) == tag) return entry + 8;
        }
        return 0;
    }
    std::string text(uint64_t directory, uint64_t tag) const {
        constexpr uint64_t kInline = 4;
        const uint64_t value = find(directory, tag);
        if (value == 0) return {};
        const uint64_t length = number(value - 4, 4), at = length > kInline ? number(value, 4) : value;
        if (at > size_ || length > size_ - at) return {};
        const std::string all(reinterpret_cast<const char*>(bytes_ + at), length);
        return all.substr(0, all.find('\0'));
    }
    /// The number of values that a tag has. 0: the directory has no such tag.
    uint64_t count(uint64_t directory, uint64_t tag) const {
        const uint64_t value = find(directory, tag);
        return value == 0 ? 0 : number(value - 4, 4);
    }
    /// A tag's value k, which is a fraction: its two numbers, or zeros.
    std::pair<uint64_t, uint64_t> fraction(uint64_t directory, uint64_t tag, uint64_t k = 0) const {
        const uint64_t entry = find(directory, tag), at = entry == 0 ? 0 : number(entry, 4);
        if (at == 0) return {};
        return {number(at + 8 * k, 4), number(at + 8 * k + 4, 4)};
    }

  private:
    const std::byte* bytes_;
    uint64_t size_;
};

double ratio(const std::pair<uint64_t, uint64_t>& fraction) {
    return double(fraction.first) / double(fraction.second);
}

/// The place of an EXIF block (EXIF 2.32, table 15). Receivers without a fix write zeros, or fractions 0/0.
std::optional<GpsFix> gps_of(const Exif& block) {
    constexpr uint64_t kGps = 34853, kLatitude = 2, kLongitude = 4, kBelowSea = 5, kAltitude = 6, kStatus = 9;
    constexpr double kDeepest = -1000, kHighest = 20000;  // m
    const uint64_t entry = block.find(block.first(), kGps), gps = entry == 0 ? 0 : block.number(entry, 4);
    if (gps == 0 || block.text(gps, kStatus) == "V") return {};
    // Degrees, minutes and seconds; the tag before says on which side.
    const auto angle = [&](uint64_t tag, const std::string& positive, const std::string& negative) {
        const std::string side = block.text(gps, tag - 1);
        if (block.count(gps, tag) != 3 || (side != positive && side != negative)) return std::nan("");
        const double degrees = ratio(block.fraction(gps, tag)) + ratio(block.fraction(gps, tag, 1)) / 60 +
                               ratio(block.fraction(gps, tag, 2)) / 3600;
        return side == negative ? -degrees : degrees;
    };
    GpsFix fix{angle(kLatitude, "N", "S"), angle(kLongitude, "E", "W"), {}};
    const bool valid = std::abs(fix.latitude) <= 90 && std::abs(fix.longitude) <= 180;
    if (!valid || (fix.latitude == 0 && fix.longitude == 0)) return {};
    const uint64_t below = block.find(gps, kBelowSea);
    const double altitude =
        (below != 0 && block.number(below, 1) == 1 ? -1 : 1) *
        (block.count(gps, kAltitude) == 1 ? ratio(block.fraction(gps, kAltitude)) : std::nan(""));
    if (altitude >= kDeepest && altitude <= kHighest) fix.altitude = altitude;
    return fix;
}

}  // namespace

int exif_orientation(const void* exif, uint64_t size) {
    constexpr uint64_t kTag = 274;
    const Exif block(exif, size);
    const uint64_t value = block.find(block.first(), kTag);
    return value == 0 ? 1 : int(block.number(value, 2));
}

Shot exif_shot(const void* exif, uint64_t size) {
    constexpr uint64_t kMake = 271, kModel = 272, kPhoto = 34665, kFocal = 37386, kFocal35 = 41989;
    constexpr uint64_t kTime = 33434, kAperture = 33437, kIso = 34855;  // EXIF 2.32, table 8
    const Exif block(exif, size);
    const uint64_t first = block.first();
    Shot shot;
    shot.lens = block.text(first, kMake);
    shot.lens.append("/").append(block.text(first, kModel));
    shot.gps = gps_of(block);
    const uint64_t photo = block.find(first, kPhoto), details = photo == 0 ? 0 : block.number(photo, 4);
    if (details == 0) return shot;
    const auto small = [&](uint64_t tag) {
        const uint64_t at = block.find(details, tag);
        return at == 0 ? 0 : block.number(at, 2);
    };
    const auto fraction = [&](uint64_t tag) { return block.fraction(details, tag); };
    const auto [focal, unit] = fraction(kFocal);
    for (const uint64_t number : {focal, unit, small(kFocal35)})
        shot.lens.append("/").append(std::to_string(number));
    const double aperture = ratio(fraction(kAperture));
    const double exposure = std::log2(ratio(fraction(kTime)) * double(small(kIso)) / (aperture * aperture));
    if (std::isfinite(exposure)) shot.exposure = exposure;
    return shot;
}

Image decode(std::span<const unsigned char> bytes, const std::string& what, int largest) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const Format* format = image::format_of(text);
    if (!format || !format->read) throw InputError(core::one_line(what + ": is neither PNG nor JPEG"));
    return with_name(what, [&] {
        const File file(platform::stream_of(bytes.data(), bytes.size()));
        if (!file) throw std::bad_alloc();
        const ImageSize size = format->read(file.get(), bytes.size(), false).size;
        if (size.width > largest || size.height > largest)
            throw std::runtime_error("it has " + std::to_string(size.width) + " x " +
                                     std::to_string(size.height) + " pixels, more than " +
                                     std::to_string(largest) + " in a direction");
        std::rewind(file.get());
        return with_colour(format->read(file.get(), bytes.size(), true));
    });
}

std::string image_fault(const fs::path& path) try {
    with_name(path.string(), [&] {
        const File file = open_file(path);
        if (ewa::format_of(file.get()).read == read_jpeg)
            check_jpeg(file.get(), fs::file_size(path));
        else
            read_file(path, true);
    });
    return {};
} catch (const InputError& error) {
    // The caller knows the file.
    const std::string text = error.what();
    for (const std::string& start : {path.string() + kNotReadable, path.string() + ": "})
        if (const std::string name = core::one_line(start); text.starts_with(name))
            return std::string(core::trim(text.substr(name.size())));
    return text;
}

bool ends_as_an_image(const fs::path& path) try {
    const std::string_view name = format_name(path);
    const std::string_view end = name == "jpeg"  ? "\xff\xd9"sv
                                 : name == "png" ? "IEND\xae\x42\x60\x82"sv
                                                 : ""sv;
    core::FileReader reader(path);
    if (reader.size() < end.size()) return false;
    reader.go_to(reader.size() - end.size(), "its end");
    return std::memcmp(reader.take(end.size(), "its end"), end.data(), end.size()) == 0;
} catch (const InputError&) {
    return false;
}

Shot shot_of(const fs::path& path) try {
    return with_name(path.string(), [&] {
        const File file = open_file(path);
        return ewa::format_of(file.get()).read == read_jpeg ? jpeg_shot(file.get()) : Shot();
    });
} catch (const InputError&) {
    return {};
}

std::string_view format_name(const fs::path& path) {
    return with_name(path.string(), [&] { return ewa::format_of(open_file(path).get()).name; });
}

std::vector<fs::path> images_below(const fs::path& folder) try {
    // Extensions that are read, and extensions of other images. The latter are errors, so that no image is
    // overlooked.
    static constexpr std::string_view kExtensions[] = {
        ".bmp", ".dib",  ".env",  ".exr", ".hdr",  ".jfi", ".jfif", ".jif",  ".jpe", ".jpeg",
        ".jpg", ".mxr",  ".pfm",  ".pgm", ".png",  ".pnm", ".ppm",  ".rgbe", ".sm",  ".sxr",
        ".tif", ".tiff", ".tx",   ".vsm", ".webp", ".dds", ".dpx",  ".gif",  ".ico", ".jp2",
        ".j2k", ".heic", ".heif", ".hif", ".avif", ".pbm", ".psd",  ".tga"};
    std::vector<fs::path> found;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
        if (const std::string extension = core::lower(entry.path().extension().string());
            entry.is_regular_file() && std::ranges::find(kExtensions, extension) != std::end(kExtensions))
            found.push_back(core::inside(entry.path(), folder));  // of links: their own names
    std::erase_if(found, core::is_of_desktop);
    std::ranges::sort(found);
    return found;
} catch (const fs::filesystem_error& error) {
    throw InputError(
        core::one_line(folder.string() + ": the folder cannot be read: " + error.code().message()));
}

}  // namespace image

}  // namespace ewa
