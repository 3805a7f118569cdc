// SPDX-License-Identifier: Apache-2.0
// OpenEXR: magic, version and flags, attributes (name, type, size, value) up to an empty name, table of
// chunks, chunks. OpenEXR takes memory for its tables and tiles when it opens a file. It reports missing
// chunks itself.
#include <algorithm>
#include <string>

#include "image/codecs.h"

namespace ewa::image {

namespace {

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

}  // namespace

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
    // OpenEXR takes room for 256 lines, which is the most that it packs together.
    check_limits({found.image.width, 1, found.image.channels, 256 * sizeof(float)}, reader.size());
    const uint64_t w = found.tile_width, h = found.tile_height;
    if (w == 0) return;
    if (w > kMaxSide || h > kMaxSide || w * h > kMaxTilePixels)
        reader.fail("the EXR claims tiles of " + std::to_string(w) + " x " + std::to_string(h) + " pixels");
    constexpr uint64_t kLeastBytes = 8 + 20;  // an entry of the table and a tile's header
    reader.require_room(((found.image.width + w - 1) / w) * ((found.image.height + h - 1) / h), kLeastBytes,
                        "tiles");
}

}  // namespace ewa::image
