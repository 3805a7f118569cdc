// SPDX-License-Identifier: Apache-2.0
// OpenEXR file layout: magic, version and flags, attributes (name, type, size, value) up to an empty name,
// the table of chunks, chunks. A damaged or missing chunk is an error of OpenEXR's.
#include <algorithm>
#include <bit>
#include <string>

#include "image/format.h"
#include "image/integers.h"

namespace ewa::image {

namespace {

constexpr uint32_t kLongNames = 0x400, kDeep = 0x800, kParts = 0x1000;
constexpr size_t kMaxName = 255;

struct Header {
    bool window = false, tiles = false;
    int64_t left = 0, top = 0, right = -1, bottom = -1;  // inclusive
    uint64_t channels = 0, tile_width = 0, tile_height = 0;
};

int64_t signed_number(core::FileReader& reader) {
    return reader.read<int32_t>("the EXR's header");
}

/// name, pixel type, linearity, sampling in x and y; up to an empty name.
void read_channels(core::FileReader& reader, uint64_t end, Header& header) {
    const char* const what = "the EXR's list of channels";
    while (!reader.read_zero_terminated(kMaxName, what).empty()) {
        reader.skip(8, what);
        const auto x = reader.read<int32_t>(what), y = reader.read<int32_t>(what);
        if (x != 1 || y != 1) reader.fail("the EXR has channels of fewer pixels (luminance and chroma)");
        if (++header.channels > kMaxChannels || reader.offset() > end)
            reader.fail("the EXR's list of channels is damaged or has more than " +
                        std::to_string(kMaxChannels));
    }
}

void read_attribute(core::FileReader& reader, const std::string& name, Header& header) {
    const std::string type = reader.read_zero_terminated(kMaxName, "the EXR's header");
    const auto size = reader.read<uint32_t>("the EXR's header");
    reader.require_room(size, 1, ("bytes of the EXR's attribute " + name).c_str());
    const uint64_t end = reader.offset() + size;
    if (name == "channels" && type == "chlist") {
        read_channels(reader, end, header);
    } else if (name == "dataWindow" && type == "box2i" && size == 16) {
        header.window = true;
        header.left = signed_number(reader);
        header.top = signed_number(reader);
        header.right = signed_number(reader);
        header.bottom = signed_number(reader);
    } else if (name == "tiles" && type == "tiledesc" && size == 9) {
        header.tiles = true;
        header.tile_width = reader.read<uint32_t>("the EXR's tiles");
        header.tile_height = reader.read<uint32_t>("the EXR's tiles");
    }
    reader.go_to(end, "the EXR's header");
}

/// Tables of chunks and buffers of tiles are allocated when the file is opened.
void check_tiles(const core::FileReader& reader, const Header& header, const Claim& claim) {
    const uint64_t w = header.tile_width, h = header.tile_height;
    if (w < 1 || h < 1 || w > kMaxSide || h > kMaxSide || w * h > kMaxTilePixels)
        reader.fail("the EXR claims tiles of " + std::to_string(w) + " x " + std::to_string(h) + " pixels");
    constexpr uint64_t kLeastBytes = 8 + 20;  // a table's entry, a tile's header
    reader.require_room(((claim.width + w - 1) / w) * ((claim.height + h - 1) / h), kLeastBytes, "tiles");
}

}  // namespace

Claim look_at_exr(core::FileReader& reader) {
    reader.skip(4, "the signature");
    const auto version = reader.read<uint32_t>("the EXR's version");
    if ((version & 0xff) != 2) reader.fail("the EXR is of version " + std::to_string(version & 0xff));
    if (version & (kDeep | kParts))
        reader.fail("the EXR is deep or of several parts; flatten it, or save one part");
    Header header;
    const size_t longest = version & kLongNames ? kMaxName : 31;
    for (std::string name; name = reader.read_zero_terminated(longest, "the EXR's header"), !name.empty();)
        read_attribute(reader, name, header);
    if (!header.window || header.right < header.left || header.bottom < header.top)
        reader.fail("the EXR has no data window");
    Claim claim{uint64_t(header.right - header.left + 1), uint64_t(header.bottom - header.top + 1),
                header.channels, sizeof(float)};
    check_claim(reader, claim);
    // Lines are packed by up to 256, and room for so many is taken however few there are.
    check_claim(reader, {claim.width, 1, claim.channels, 256 * sizeof(float)});
    if (header.tiles) check_tiles(reader, header, claim);
    return claim;
}

}  // namespace ewa::image
