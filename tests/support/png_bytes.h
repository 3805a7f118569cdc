// SPDX-License-Identifier: Apache-2.0
// PNG files put together by hand: what no writer writes, and what ours does not.
#pragma once
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "ewa/image.h"
#include "support/temp_folder.h"

namespace ewa::test {

/// The last `bytes` of a value, the highest first.
inline std::string big(uint32_t value, size_t bytes = 4) {
    const std::string text = bytes_of(value);
    return {text.rend() - std::ptrdiff_t(bytes), text.rend()};
}

inline std::string deflated(const std::string& bytes) {
    uLongf size = compressBound(uLong(bytes.size()));
    std::string out(size, '\0');
    compress(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
             uLong(bytes.size()));
    out.resize(size);
    return out;
}

inline std::string png_chunk(const std::string& type, const std::string& data) {
    const auto sum = crc32(0, reinterpret_cast<const Bytef*>((type + data).data()), uInt(4 + data.size()));
    return big(uint32_t(data.size())) + type + data + big(uint32_t(sum));
}

/// `kind` is five bytes: bits, colour type, compression, filters, interlacing. `notes` are chunks before the
/// pixels'.
inline std::string png_bytes(uint32_t width, uint32_t height, const std::string& kind,
                             const std::string& notes, const std::string& rows) {
    return "\x89PNG\r\n\x1a\n" + png_chunk("IHDR", big(width) + big(height) + kind) + notes +
           png_chunk("IDAT", deflated(rows)) + png_chunk("IEND", "");
}

/// Of 16 bits a value, which are the nearest to those of the picture (3 channels) between 0 and 1.
inline std::string deep_png(const Image& image) {
    std::string rows;
    for (int y = 0; y < image.height; ++y) {
        rows += '\0';  // no filter
        for (int i = 0; i < image.width * 3; ++i)
            rows += big(uint32_t(std::lround(std::clamp(image.at(0, y)[i], 0.0f, 1.0f) * 65535)), 2);
    }
    return png_bytes(uint32_t(image.width), uint32_t(image.height), std::string("\x10\2\0\0\0", 5), "", rows);
}

}  // namespace ewa::test
