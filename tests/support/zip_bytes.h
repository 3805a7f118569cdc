// SPDX-License-Identifier: Apache-2.0
// Zip archives with entries that are deflated, encrypted or wrong.
#pragma once
#include <gtest/gtest.h>
#include <zlib.h>

#include <string>
#include <vector>

#include "support/temp_folder.h"

namespace ewa::test {

struct ZipEntry {
    std::string name, content;
    uint16_t method = 0, flags = 0;
    uint32_t claimed = 0;  // size; 0: the true one
    uint32_t sum = 0;      // added to the checksum
};

/// A zip archive by the format's specification (APPNOTE.TXT).
inline std::string zipped(const std::vector<ZipEntry>& entries) {
    std::string bytes, directory;
    for (const ZipEntry& e : entries) {
        std::string packed = e.content;
        if (e.method == 8) {
            z_stream stream{};
            EXPECT_EQ(deflateInit2(&stream, 9, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
            packed.resize(e.content.size() + 1000);
            stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(e.content.data()));
            stream.avail_in = uInt(e.content.size());
            stream.next_out = reinterpret_cast<Bytef*>(packed.data());
            stream.avail_out = uInt(packed.size());
            EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
            packed.resize(stream.total_out);
            deflateEnd(&stream);
        }
        const auto sum =
            uint32_t(crc32_z(0, reinterpret_cast<const Bytef*>(e.content.data()), e.content.size()));
        const std::string shared = bytes_of(uint16_t(20)) + bytes_of(e.flags) + bytes_of(e.method) +
                                   bytes_of(uint32_t(0)) + bytes_of(sum + e.sum) +
                                   bytes_of(uint32_t(packed.size())) +
                                   bytes_of(e.claimed ? e.claimed : uint32_t(e.content.size())) +
                                   bytes_of(uint16_t(e.name.size())) + bytes_of(uint16_t(0));
        directory += "PK\1\2" + bytes_of(uint16_t(20)) + shared + std::string(10, '\0') +
                     bytes_of(uint32_t(bytes.size())) + e.name;
        bytes += "PK\3\4" + shared + e.name + packed;
    }
    const auto count = uint16_t(entries.size());
    return bytes + directory + "PK\5\6" + std::string(4, '\0') + bytes_of(count) + bytes_of(count) +
           bytes_of(uint32_t(directory.size())) + bytes_of(uint32_t(bytes.size())) + bytes_of(uint16_t(0));
}

}  // namespace ewa::test
