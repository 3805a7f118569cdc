// SPDX-License-Identifier: Apache-2.0
// TIFF 6.0 and BigTIFF: the entries of the first directory, and where its strips or tiles are. OpenImageIO
// takes a tile beyond the end of a file for one that is there. A codec reports too few bytes in a compressed
// strip itself.
#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <vector>

#include "image/codecs.h"

namespace ewa::image {

namespace {

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

/// Strips are tiles of the picture's width.
struct Parts {
    uint64_t width = 0, height = 0;
    bool tiles = false;
};

Parts parts_of(const core::FileReader& reader, Directory& directory, const ImageHeader& image) {
    Parts parts{directory.value(kTileWidth, 0), directory.value(kTileHeight, 0), true};
    if (parts.width == 0 && parts.height == 0)
        return {image.width, std::min(directory.value(kRowsPerStrip, image.height), image.height), false};
    if (parts.width > kMaxSide || parts.height > kMaxSide || parts.width * parts.height > kMaxTilePixels)
        reader.fail("the TIFF claims tiles of " + std::to_string(parts.width) + " x " +
                    std::to_string(parts.height) + " pixels");
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

}  // namespace ewa::image
