// SPDX-License-Identifier: Apache-2.0
#include "image/integrity.h"

#include <zlib.h>

#include <string>
#include <string_view>

#include "core/file_reader.h"

namespace ewa::image {

namespace {

using namespace std::string_view_literals;

constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1a\n"sv;

uint32_t big_endian(const std::byte* bytes, int count) {
    uint32_t value = 0;
    for (int i = 0; i < count; ++i) value = value << 8 | std::to_integer<uint32_t>(bytes[i]);
    return value;
}

}  // namespace

void check_png(const std::filesystem::path& path, bool checksums) {
    core::FileReader reader(path);
    if (reader.size() < kPngSignature.size() ||
        std::memcmp(reader.take(kPngSignature.size(), "the signature"), kPngSignature.data(),
                    kPngSignature.size()) != 0)
        return;
    std::string type;
    while (type != "IEND") {
        const uint32_t length = big_endian(reader.take(4, "the PNG's chunks"), 4);
        const bool first = type.empty();
        reader.require_room(uint64_t(length) + 8, 1, "bytes of a PNG chunk");
        const std::byte* chunk = reader.take(4, "a PNG chunk");
        type.assign(reinterpret_cast<const char*>(chunk), 4);
        uint32_t checksum = static_cast<uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(chunk), 4));
        if (first && (type != "IHDR" || length != 13)) reader.fail("the PNG does not start with its header");
        // The header's checksum is always looked at: its numbers are what memory is taken by.
        if (checksums || first) {
            const std::byte* data = reader.take(length, "a PNG chunk");
            checksum = static_cast<uint32_t>(crc32(checksum, reinterpret_cast<const Bytef*>(data), length));
            if (checksum != big_endian(reader.take(4, "a PNG chunk"), 4))
                reader.fail("the PNG is damaged: a checksum is wrong");
        } else {
            reader.skip(uint64_t(length) + 4, "a PNG chunk");
        }
    }
}

void check_jpeg(const std::filesystem::path& path) {
    core::FileReader reader(path);
    if (reader.size() < 3 || std::memcmp(reader.take(3, "the signature"), "\xff\xd8\xff", 3) != 0) return;
    const char* const what = "the JPEG's data (it is truncated)";
    uint32_t marker = 0xff;
    for (;;) {
        while (marker == 0xff) marker = reader.read<uint8_t>(what);  // markers may be padded with 0xff
        if (marker == 0xd9) return;
        // Neither a stuffed zero nor a restart marker has a length; what follows is entropy-coded data.
        const bool bare = marker == 0 || marker == 1 || (marker >= 0xd0 && marker <= 0xd7);
        if (!bare) {
            const uint32_t length = big_endian(reader.take(2, what), 2);
            if (length < 2) reader.fail("the JPEG is damaged: a segment's length is too short");
            reader.skip(length - 2, what);
        }
        // Between a segment and the next marker there is data only after a start of scan, which this passes
        // over too.
        while (reader.read<uint8_t>(what) != 0xff) {
        }
        marker = 0xff;
    }
}

}  // namespace ewa::image
