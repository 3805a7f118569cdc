// SPDX-License-Identifier: Apache-2.0
// WebP images as tables of bytes, four a pixel. Lossless WebP keeps each byte, also where the alpha is 0.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace ewa::io {

struct WebpHead {
    uint64_t width = 0, height = 0;
    bool lossless = false;
    uint64_t pixels() const { return width * height; }
};

/// What the header states, or an InputError that begins with `name`. An animation is refused.
WebpHead webp_head(const std::string& bytes, const std::string& name);

/// The pixels as R G B A, row by row from the top. Takes memory for width * height * 8 bytes, so check the
/// header first. Throws InputError that begins with `name`.
std::vector<uint8_t> decode_webp(const std::string& bytes, const std::string& name);

/// A lossless image of width * height pixels.
std::string encode_webp(const std::vector<uint8_t>& rgba, uint64_t width, uint64_t height);

/// The largest width and height of a WebP image.
inline constexpr uint64_t kMostWebpSide = 16383;

}  // namespace ewa::io
