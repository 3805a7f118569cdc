// SPDX-License-Identifier: Apache-2.0
#include <zlib.h>

#include <string>

#include "image/format.h"
#include "image/integers.h"

namespace ewa::image {

namespace {

/// The header chunk: width, height, bits, colour type.
Claim claim_of(const core::FileReader& reader, const std::byte* data) {
    constexpr uint64_t kChannels[] = {1, 0, 3, 3, 2, 0, 4};  // by colour type; a palette becomes RGB
    const uint64_t type = big_endian(data + 9, 1);
    if (type > 6 || kChannels[type] == 0) reader.fail("the PNG's colour type is none");
    return {big_endian(data, 4), big_endian(data + 4, 4), kChannels[type],
            big_endian(data + 8, 1) > 8 ? uint64_t(2) : 1};
}

}  // namespace

Claim look_at_png(core::FileReader& reader, bool whole) {
    constexpr uint64_t kSignatureBytes = 8;
    reader.skip(kSignatureBytes, "the signature");
    Claim claim;
    std::string type;
    while (type != "IEND") {
        const auto length = static_cast<uint32_t>(big_endian(reader.take(4, "the PNG's chunks"), 4));
        const bool first = type.empty();
        reader.require_room(uint64_t(length) + 8, 1, "bytes of a PNG chunk");
        const std::byte* chunk = reader.take(4, "a PNG chunk");
        type.assign(reinterpret_cast<const char*>(chunk), 4);
        uLong checksum = crc32(0, reinterpret_cast<const Bytef*>(chunk), 4);
        if (first && (type != "IHDR" || length != 13)) reader.fail("the PNG does not start with its header");
        // The header's checksum is always looked at: its numbers are what memory is taken by.
        if (!whole && !first) {
            reader.skip(uint64_t(length) + 4, "a PNG chunk");
            continue;
        }
        for (uint32_t left = length; left > 0;) {
            const uint32_t part = std::min(left, uint32_t(1) << 20);
            const std::byte* data = reader.take(part, "a PNG chunk");
            if (first) claim = claim_of(reader, data);
            checksum = crc32(checksum, reinterpret_cast<const Bytef*>(data), part);
            left -= part;
        }
        if (checksum != big_endian(reader.take(4, "a PNG chunk"), 4))
            reader.fail("the PNG is damaged: a checksum is wrong");
        if (first) check_claim(reader, claim);
    }
    return claim;
}

}  // namespace ewa::image
