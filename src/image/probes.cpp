// SPDX-License-Identifier: Apache-2.0
// The probes of the formats that OpenImageIO reads. Radiance HDR needs none: OpenImageIO opens it without
// taking memory for its pixels.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "core/text.h"
#include "image/image_files.h"

namespace ewa::image {

namespace {

void check_tile(const core::FileReader& reader, const std::string& format, uint64_t width, uint64_t height) {
    if (width > kMaxSide || height > kMaxSide || width * height > kMaxTilePixels)
        reader.fail("the " + format + " claims tiles of " + std::to_string(width) + " x " +
                    std::to_string(height) + " pixels");
}

// TIFF 6.0 and BigTIFF: the entries of the first directory, and where its strips or tiles are. OpenImageIO
// takes a tile beyond the end of a file for one that is there. A codec reports too few bytes in a compressed
// strip itself.

enum Tag : uint64_t {
    kWidth = 256,
    kHeight = 257,
    kBits = 258,
    kCompression = 259,
    kStripOffsets = 273,
    kSamples = 277,
    kRowsPerStrip = 278,
    kStripBytes = 279,
    kPlanar = 284,
    kTileWidth = 322,
    kTileHeight = 323,
    kTileOffsets = 324,
    kTileBytes = 325
};

constexpr uint64_t kNotCompressed = 1;
/// None, LZW, JPEG, deflate (both numbers), PackBits. The others are of fax machines and archives.
constexpr std::array<uint64_t, 6> kCompressions = {kNotCompressed, 5, 7, 8, 32946, 32773};

/// Bytes of an unsigned integer of a TIFF type; 0 for the other types.
int width_of(uint64_t type) {
    return type == 1 ? 1 : type == 3 ? 2 : type == 4 ? 4 : type == 16 ? 8 : 0;
}

class Directory {
  public:
    explicit Directory(core::FileReader& reader) : reader_(reader) {
        const std::byte* order = reader.take(4, "the TIFF's header");
        big_endian_ = order[0] == std::byte('M');
        big_ = order[big_endian_ ? 3 : 2] == std::byte(43);
        if (big_ && (number(2) != 8 || number(2) != 0)) reader.fail("the BigTIFF's header is damaged");
        reader.go_to(number(big_ ? 8 : 4), "the TIFF's directory");
        const uint64_t count = number(big_ ? 8 : 2);
        reader.require_room(count, big_ ? 20 : 12, "entries of the TIFF's directory");
        const uint64_t begin = reader.offset();
        for (uint64_t i = 0; i < count; ++i) {
            reader.go_to(begin + i * (big_ ? 20 : 12), "the TIFF's directory");
            const uint64_t tag = number(2);
            Entry& entry = entries_[tag];
            entry.bytes = width_of(number(2));
            entry.count = number(big_ ? 8 : 4);
            entry.at = reader.offset();
        }
    }

    /// The values of an entry; none where it is not there.
    std::vector<uint64_t> values(Tag tag) {
        const auto found = entries_.find(tag);
        if (found == entries_.end()) return {};
        const Entry& entry = found->second;
        if (entry.bytes == 0) reader_.fail("the TIFF's tag " + std::to_string(tag) + " is no number");
        reader_.go_to(entry.at, "the TIFF's directory");
        if (entry.count > (big_ ? 8u : 4u) / uint64_t(entry.bytes))
            reader_.go_to(number(big_ ? 8 : 4), "values of the TIFF's directory");
        reader_.require_room(entry.count, uint64_t(entry.bytes), "values of a TIFF tag");
        std::vector<uint64_t> values(entry.count);
        for (uint64_t& value : values) value = number(entry.bytes);
        return values;
    }

    /// The first value of an entry.
    uint64_t value(Tag tag, uint64_t otherwise) {
        const std::vector<uint64_t> all = values(tag);
        return all.empty() ? otherwise : all[0];
    }

  private:
    struct Entry {
        int bytes = 0;
        uint64_t count = 0, at = 0;
    };

    uint64_t number(int bytes) {
        const std::byte* at = reader_.take(size_t(bytes), "the TIFF's directory");
        return big_endian_ ? big_endian(at, bytes) : little_endian(at, bytes);
    }

    core::FileReader& reader_;
    bool big_endian_ = false, big_ = false;
    std::map<uint64_t, Entry> entries_;
};

/// Strips are tiles of the image's width.
struct Parts {
    uint64_t width = 0, height = 0;
    bool tiles = false;
};

Parts parts_of(const core::FileReader& reader, Directory& directory, const ImageHeader& image) {
    Parts parts{directory.value(kTileWidth, 0), directory.value(kTileHeight, 0), true};
    if (parts.width == 0 && parts.height == 0)
        return {image.width, std::min(directory.value(kRowsPerStrip, image.height), image.height), false};
    check_tile(reader, "TIFF", parts.width, parts.height);
    return parts;
}

/// Every strip or tile is in the file and, where it is not compressed, holds its rows.
void check_parts(const core::FileReader& reader, Directory& directory, const ImageHeader& image,
                 uint64_t bits, bool compressed, uint64_t planes) {
    const Parts parts = parts_of(reader, directory, image);
    if (parts.width < 1 || parts.height < 1) reader.fail("the TIFF has strips or tiles of no pixels");
    const auto offsets = directory.values(parts.tiles ? kTileOffsets : kStripOffsets);
    const auto bytes = directory.values(parts.tiles ? kTileBytes : kStripBytes);
    const uint64_t across = (image.width + parts.width - 1) / parts.width,
                   down = (image.height + parts.height - 1) / parts.height;
    if (offsets.size() < across * down * planes || bytes.size() < across * down * planes)
        reader.fail("the TIFF does not say where all its strips or tiles are");
    const uint64_t row_bits = parts.width * bits * (planes > 1 ? 1 : image.channels);
    for (uint64_t i = 0; i < across * down * planes; ++i) {
        const uint64_t begin = i % (across * down) / across * parts.height;
        const uint64_t rows = parts.tiles ? parts.height : std::min(parts.height, image.height - begin);
        const uint64_t least = compressed ? 1 : (row_bits + 7) / 8 * rows;
        if (offsets[i] > reader.size() || bytes[i] > reader.size() - offsets[i])
            reader.fail("the TIFF is truncated: its strip or tile " + std::to_string(i) + " of " +
                        std::to_string(bytes[i]) + " bytes at byte " + std::to_string(offsets[i]) +
                        " is not in a file of " + std::to_string(reader.size()));
        if (bytes[i] < least)
            reader.fail("the TIFF is incomplete: its strip or tile " + std::to_string(i) + " has " +
                        std::to_string(bytes[i]) + " bytes of at least " + std::to_string(least));
    }
}

// OpenEXR: magic, version and flags, attributes (name, type, size, value) up to an empty name, table of
// chunks, chunks. OpenEXR takes memory for its tables and tiles when it opens a file. It reports missing
// chunks itself.

constexpr uint32_t kLongNames = 0x400, kDeep = 0x800, kParts = 0x1000;
constexpr size_t kMaxName = 255;
const char* const kHeader = "the EXR's header";

struct Attributes {
    ImageHeader image{0, 0, 0, sizeof(float)};
    uint64_t tile_width = 0, tile_height = 0;  // 0 in a file of lines
};

/// Name, pixel type, linearity, sampling in x and y for each channel, up to an empty name.
uint64_t count_channels(core::FileReader& reader, uint64_t end) {
    const char* const what = "the EXR's list of channels";
    uint64_t channels = 0;
    while (!reader.read_zero_terminated(kMaxName, what).empty()) {
        reader.skip(8, what);
        const auto x = reader.read<int32_t>(what), y = reader.read<int32_t>(what);
        if (x != 1 || y != 1) reader.fail("the EXR has channels of fewer pixels (luminance and chroma)");
        if (++channels > kMaxChannels || reader.offset() > end)
            reader.fail("the EXR's list of channels is damaged or has more than " +
                        std::to_string(kMaxChannels));
    }
    return channels;
}

void read_attribute(core::FileReader& reader, const std::string& name, Attributes& out) {
    const std::string type = reader.read_zero_terminated(kMaxName, kHeader);
    const auto size = reader.read<uint32_t>(kHeader);
    reader.require_room(size, 1, "bytes of the EXR's attribute " + name);
    const uint64_t end = reader.offset() + size;
    if (name == "channels" && type == "chlist") {
        out.image.channels = count_channels(reader, end);
    } else if (name == "dataWindow" && type == "box2i" && size == 16) {
        int64_t window[4];  // left, top, right, bottom, inclusive
        for (int64_t& side : window) side = reader.read<int32_t>(kHeader);
        out.image.width = uint64_t(std::max<int64_t>(window[2] - window[0] + 1, 0));
        out.image.height = uint64_t(std::max<int64_t>(window[3] - window[1] + 1, 0));
    } else if (name == "tiles" && type == "tiledesc" && size == 9) {
        out.tile_width = std::max(1u, reader.read<uint32_t>(kHeader));
        out.tile_height = std::max(1u, reader.read<uint32_t>(kHeader));
    }
    reader.go_to(end, kHeader);
}

/// The next number of a PNM's header. White space and comments precede it, and one white space follows.
uint64_t pnm_number(core::FileReader& reader) {
    const char* const what = "the PNM's header";
    constexpr size_t kMostDigits = 9;
    std::string digits;
    for (;;) {
        const char c = reader.read<char>(what);
        if (c == '#') {
            while (reader.read<char>(what) != '\n') {
            }
        } else if (c >= '0' && c <= '9' && digits.size() < kMostDigits) {
            digits += c;
        } else if (c != ' ' && c != '\t' && c != '\n' && c != '\r') {
            reader.fail("the PNM's header is damaged");
        } else if (!digits.empty()) {
            return *core::parse_integer<uint64_t>(digits);
        }
    }
}

}  // namespace

void probe_tiff(core::FileReader& reader) {
    Directory directory(reader);
    const uint64_t bits = directory.value(kBits, 1),
                   compression = directory.value(kCompression, kNotCompressed);
    if (bits < 1 || bits > 64) reader.fail("the TIFF has values of " + std::to_string(bits) + " bits");
    const ImageHeader image{directory.value(kWidth, 0), directory.value(kHeight, 0),
                            directory.value(kSamples, 1), (bits + 7) / 8};
    check_limits(image, reader.size());
    if (std::find(kCompressions.begin(), kCompressions.end(), compression) == kCompressions.end())
        reader.fail("the TIFF is compressed by method " + std::to_string(compression) +
                    "; save it with none, LZW, deflate, PackBits or JPEG");
    const bool planar = directory.value(kPlanar, 1) == 2;
    check_parts(reader, directory, image, bits, compression != kNotCompressed, planar ? image.channels : 1);
}

void probe_exr(core::FileReader& reader) {
    reader.skip(4, "the signature");
    const auto version = reader.read<uint32_t>("the EXR's version");
    if ((version & 0xff) != 2) reader.fail("the EXR is of version " + std::to_string(version & 0xff));
    if (version & (kDeep | kParts))
        reader.fail("the EXR is deep or of several parts; flatten it, or save one part");
    Attributes found;
    const size_t longest = version & kLongNames ? kMaxName : 31;
    for (std::string name; name = reader.read_zero_terminated(longest, kHeader), !name.empty();)
        read_attribute(reader, name, found);
    if (found.image.width < 1 || found.image.height < 1) reader.fail("the EXR has no data window");
    check_limits(found.image, reader.size());
    // OpenEXR allocates memory for 256 lines, which is the most that it packs together.
    check_limits({found.image.width, 1, found.image.channels, 256 * sizeof(float)}, reader.size());
    const uint64_t w = found.tile_width, h = found.tile_height;
    if (w == 0) return;
    check_tile(reader, "EXR", w, h);
    constexpr uint64_t kLeastBytes = 8 + 20;  // an entry of the table and a tile's header
    reader.require_room(((found.image.width + w - 1) / w) * ((found.image.height + h - 1) / h), kLeastBytes,
                        "tiles");
}

void probe_webp(core::FileReader& reader) {
    const char* const what = "the WebP's header";
    reader.skip(4, what);
    reader.require_room(reader.read<uint32_t>(what), 1, "bytes of the WebP");
    const std::byte* data = reader.take(22, what);
    const std::string type(reinterpret_cast<const char*>(data + 4), 4);
    const std::byte* header = data + 12;
    ImageHeader image{0, 0, 4, 1};
    bool transparent = false;
    if (type == "VP8X") {
        if ((header[0] & std::byte(0x02)) != std::byte(0))
            reader.fail("the WebP is a film; a picture is wanted");
        transparent = (header[0] & std::byte(0x10)) != std::byte(0);
        image.width = little_endian(header + 4, 3) + 1;
        image.height = little_endian(header + 7, 3) + 1;
    } else if (type == "VP8L") {
        const uint64_t sizes = little_endian(header + 1, 4);
        image.width = (sizes & 0x3fff) + 1;
        image.height = (sizes >> 14 & 0x3fff) + 1;
        transparent = (sizes >> 28 & 1) != 0;
    } else if (type == "VP8 ") {
        image.width = little_endian(header + 6, 2) & 0x3fff;
        image.height = little_endian(header + 8, 2) & 0x3fff;
    } else {
        reader.fail("the WebP begins with no picture");
    }
    // OpenImageIO multiplies the colour of a WebP by its alpha, whatever it is asked.
    if (transparent) reader.fail("the WebP is transparent; convert it to PNG");
    check_limits(image, reader.size());
}

/// OpenImageIO would unpack a run-length coded BMP when it opens it, before its size is checked.
void probe_bmp(core::FileReader& reader) {
    const std::byte* header = reader.take(34, "the BMP's header");
    if (little_endian(header + 14, 4) < 40) reader.fail("the BMP is of a kind from before 1990");
    const uint64_t bits = little_endian(header + 28, 2), packing = little_endian(header + 30, 4);
    // Pixels as they are, or with masks that say where the colours are in 16 or 32 bits.
    if (packing != 0 && packing != 3) reader.fail("the BMP is run-length coded; save it uncompressed");
    if (bits != 8 && bits != 24 && bits != 32)
        reader.fail("the BMP has " + std::to_string(bits) + " bits a pixel, not 8, 24 or 32");
    // A negative height means that the first row is the top one.
    const auto width = static_cast<int32_t>(little_endian(header + 18, 4)),
               height = static_cast<int32_t>(little_endian(header + 22, 4));
    const uint64_t offset = little_endian(header + 10, 4), rows = uint64_t(std::abs(int64_t(height)));
    const ImageHeader image{uint64_t(std::max(width, 0)), rows, bits == 32 ? uint64_t(4) : 3, 1};
    check_limits(image, reader.size());
    reader.go_to(offset, "the BMP's pixels");
    reader.require_room(rows, (image.width * bits + 31) / 32 * 4, "rows of pixels");
}

/// OpenImageIO reads the pixels of a PNM when it opens it. It also rescales values that end at another number
/// than 255, and rounds them.
void probe_pnm(core::FileReader& reader) {
    const uint64_t channels = reader.take(2, "the signature")[1] == std::byte('6') ? 3 : 1;
    const uint64_t width = pnm_number(reader), height = pnm_number(reader), largest = pnm_number(reader);
    if (largest != 255)
        reader.fail("the PNM's largest value is " + std::to_string(largest) + ", not 255; convert it to PNG");
    check_limits({width, height, channels, 1}, reader.size());
    reader.require_room(height, width * channels, "rows of pixels");
}

}  // namespace ewa::image
