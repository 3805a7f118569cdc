// SPDX-License-Identifier: Apache-2.0
// Damaged PNGs whose checksums are right.
#pragma once
#include <zlib.h>

#include <cstdint>
#include <string>

namespace ewa::fuzz {

inline constexpr size_t kPngSignature = 8, kPngLength = 4,
                        kPngFrame = 12;  // length, type and checksum of a chunk

/// Gives each chunk of a PNG its checksum. Otherwise every mutation would end there.
inline void sum_png_chunks(std::string& bytes) {
    if (!bytes.starts_with("\x89PNG")) return;
    const auto* data = reinterpret_cast<const Bytef*>(bytes.data());
    for (size_t at = kPngSignature; at + kPngFrame <= bytes.size();) {
        const uint64_t length = uint64_t(data[at]) << 24 | uint64_t(data[at + 1]) << 16 |
                                uint64_t(data[at + 2]) << 8 | uint64_t(data[at + 3]);
        if (length > bytes.size() - at - kPngFrame) break;
        const auto sum = uint32_t(crc32_z(0, data + at + kPngLength, 4 + length));
        const size_t end = at + kPngFrame - 4 + length;
        for (size_t i = 0; i < 4; ++i) bytes[end + i] = char(sum >> (24 - 8 * i));
        at = end + 4;
    }
}

}  // namespace ewa::fuzz
