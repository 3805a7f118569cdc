// SPDX-License-Identifier: Apache-2.0
// Image files beyond include/ewa/image.h, and their codecs: libpng, libjpeg, and OpenImageIO for all other
// formats.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/file_reader.h"
#include "ewa/image.h"

namespace ewa::image {

/// The PNG or JPEG that these bytes hold, as load_image returns it. Throws InputError that begins with
/// `what`, also for any other format, and for more than `largest` pixels in a direction.
Image decode(std::span<const unsigned char> bytes, const std::string& what, int largest);

/// The bytes of a PNG of 1 to 4 channels and 8 bits: clamped to [0, 1], rounded, NaN as 0. Throws RunError.
std::vector<unsigned char> encode_png(const Image& image);

/// The bytes of a JPEG of an RGB image, rounded as encode_png does, with colour at full resolution. quality: 1 to
/// 100. Throws RunError.
std::vector<unsigned char> encode_jpeg(const Image& image, int quality);

/// The bytes of a PNG or JPEG with XMP in a chunk or marker of its own ("XMP Specification Part 3: Storage in Files"): after
/// IHDR, or after JFIF's marker. packet: the XML. Throws RunError where it is too long for a marker.
std::vector<unsigned char> with_xmp(std::vector<unsigned char> bytes, const std::string& packet);

/// GPano's description of an equirectangular image of all directions. width, height: px.
std::string panorama_xmp(int width, int height);

/// The values as bytes: clamped to [0, 1], rounded, NaN as 0.
std::vector<uint8_t> eight_bit_values(const Image& image);

/// The format by the file's first bytes: png, jpeg, tiff, openexr, webp, bmp, pnm or hdr. Throws InputError for
/// any other file.
std::string_view format_name(const std::filesystem::path& path);

/// The reason why the image cannot be read, without the file's name. Empty if it can be read. Decodes the pixels. A JPEG is
/// decoded at an eighth of its size, which finds the same damage in less time and memory.
std::string image_fault(const std::filesystem::path& path);

/// Whether a PNG or JPEG file ends with the bytes that mark its end. Does not decode the image. True for other formats.
bool ends_as_an_image(const std::filesystem::path& path);

/// Whether OpenImageIO can be loaded and has libheif.
bool reads_heif();
/// Converts a HEIF photo as OpenImageIO::jpeg_of_heif does. Returns whether the JPEG was written.
bool write_jpeg_of_heif(const std::filesystem::path& heif, const std::filesystem::path& jpeg);

/// A position by a satellite receiver: WGS 84, degrees. Finite, and within the ranges of the globe.
struct GpsFix {
    double latitude = 0, longitude = 0;
    std::optional<double> altitude;  // m above the sea
};

/// The camera's settings by a JPEG's EXIF. Empty for other files.
struct Shot {
    std::string lens;  // text for the camera and its focal length: equal for photos of one lens at one zoom
    std::optional<double> exposure;  // log2(time * ISO / f-number^2), stops
    std::optional<GpsFix> gps;
};
Shot shot_of(const std::filesystem::path& path);

/// The files below a folder and its subfolders whose extension is one of an image, relative to the folder and
/// sorted. Links to folders are not followed. Throws InputError where a folder cannot be read.
std::vector<std::filesystem::path> images_below(const std::filesystem::path& folder);

// Codecs. Images come from strangers, so each codec checks what the header says against the limits below
// before it takes memory or decodes. Every function from here on throws std::runtime_error with the reason
// alone; its caller knows the file's name.

/// The largest sensors of cameras have 150 to 200 million pixels. As floats, three channels of them take 2.4
/// GB.
constexpr uint64_t kMaxPixels = 200'000'000;
/// The most that JPEG allows in either direction. It also bounds a codec's tables by row or column.
constexpr uint64_t kMaxSide = 65'535;
/// OpenImageIO's own limit. EXR files keep the layers of a rendering as channels.
constexpr uint64_t kMaxChannels = 1024;
/// The most bytes of a file's decoded channels together.
constexpr uint64_t kMaxDecodedBytes = uint64_t(4) << 30;
/// The most pixels of a tile, because codecs keep several whole tiles in memory.
constexpr uint64_t kMaxTilePixels = 4096 * 4096;
/// The most scans of a progressive JPEG. A decoder visits the whole image for each scan. Encoders write about
/// ten scans.
constexpr int kMaxJpegScans = 100;
/// An image that takes more bytes than this, as floats, must come from a file of at least one
/// kMaxCompression-th of its size. Even images of a single colour compress less in every format.
constexpr uint64_t kUncheckedBytes = uint64_t(256) << 20;
constexpr uint64_t kMaxCompression = 5000;

struct ImageHeader {
    uint64_t width = 0, height = 0, channels = 0;
    uint64_t bytes_per_value = 1;
};

/// Throws where the image is empty, beyond a limit, or too large to come from a file of `file_bytes`.
void check_limits(const ImageHeader& header, uint64_t file_bytes);

/// Pixels with the channels that the file has: grey, grey and alpha, RGB, or RGBA.
struct StoredImage {
    ImageSize size;
    int channels = 0;
    std::vector<float> values;  // 8-bit values / 255, 16-bit values / 65535, floats unchanged
};

/// Reads an image from a file that is at its first byte and has `file_bytes` bytes. pixels: read the values too, and throw
/// for any damage; else only the header is read. Prints nothing.
StoredImage read_png(std::FILE* file, uint64_t file_bytes, bool pixels);
StoredImage read_jpeg(std::FILE* file, uint64_t file_bytes, bool pixels);

/// Decodes a JPEG at an eighth of its size, only to check the data.
void check_jpeg(std::FILE* file, uint64_t file_bytes);
Shot jpeg_shot(std::FILE* file);

/// The camera's settings that an EXIF block states, as in shot_of().
Shot exif_shot(const void* exif, uint64_t size);

/// The value of EXIF's tag 274. The block starts with the header of a TIFF. 1 where the tag is missing.
int exif_orientation(const void* exif, uint64_t size);

/// Reads an unsigned integer of `count` bytes, at most 8.
uint64_t big_endian(const std::byte* bytes, int count);
uint64_t little_endian(const std::byte* bytes, int count);

/// A file format that is known by its first bytes.
struct Format {
    std::string_view signature;
    std::string_view name;  // png, jpeg, or OpenImageIO's name of its reader
    /// ewa's own codec. Null: OpenImageIO reads the format.
    StoredImage (*read)(std::FILE* file, uint64_t file_bytes, bool pixels) = nullptr;
    /// Checks the structure of a file before OpenImageIO opens it. Null where that is not needed.
    void (*probe)(core::FileReader& reader) = nullptr;
};

/// The format of a file that begins with these bytes; 16 are enough. Null where ewa does not read the format.
/// OpenImageIO would open more: films, its own test patterns, and formats whose readers take memory before
/// they know the size, or invent what is missing.
const Format* format_of(std::string_view first_bytes);

/// The probes of the formats that OpenImageIO reads. They find what its codecs do not report: a size beyond
/// the limits, a part that is missing, and features that are not supported. They also throw InputError.
void probe_tiff(core::FileReader& reader);
void probe_exr(core::FileReader& reader);
void probe_webp(core::FileReader& reader);
void probe_bmp(core::FileReader& reader);
void probe_pnm(core::FileReader& reader);

// OpenImageIO is in a module that is loaded with the first image that is neither PNG nor JPEG. It brings some
// two hundred libraries, whose start takes longer than most commands. A machine without it still has PNG and
// JPEG.

/// The functions that the module exports under the name kModuleEntry. They may run on several threads at once.
/// They throw std::runtime_error with OpenImageIO's reason, without the file's name, and std::bad_alloc.
struct OpenImageIO {
    const char* version;  // EWA_VERSION; the loader reads it before it calls a function

    /// Makes OpenImageIO refuse images beyond these limits. False if this version has no such limits.
    bool (*limit)(uint64_t decoded_bytes, uint64_t channels);
    /// Reads a file whose probe has passed, by OpenImageIO's reader of this name. Calls `check` before it
    /// takes memory for the pixels.
    StoredImage (*read)(const std::string& path, const std::string& reader, bool pixels,
                        const std::function<void(const ImageHeader&)>& check);
    /// The bytes of an EXR file of 32-bit floats.
    std::vector<unsigned char> (*encode_exr)(const Image& image);
    /// Whether this OpenImageIO has libheif.
    bool (*reads_heif)();
    /// Writes the first picture of a HEIF, HEIC or AVIF file as a JPEG of 8 bits with its EXIF and colour profile, upright. Calls
    /// `check` before it takes memory for the pixels.
    void (*jpeg_of_heif)(const std::string& heif, const std::string& jpeg,
                         const std::function<void(const ImageHeader&)>& check);
};
constexpr const char* kModuleName = "libewa_openimageio";
/// The module's entry, whose name ends in the number of the layout. Increase it whenever a type above changes: a
/// module of another layout then lacks this entry, and is refused.
constexpr const char* kModuleEntry = "ewa_openimageio_layout_2";
static_assert(sizeof(void*) != 8 || (sizeof(OpenImageIO) == 48 && sizeof(StoredImage) == 48 &&
                                     sizeof(ImageHeader) == 32 && sizeof(Image) == 40));

/// Loads the module at the first call, from its folder beside the program or libewa, and sets ewa's limits.
/// Throws RunError where there is no module, or it does not fit.
const OpenImageIO& openimageio();

}  // namespace ewa::image
