// SPDX-License-Identifier: Apache-2.0
// The formats whose first bytes say it all: WebP, BMP, PNM, Radiance HDR.
#include <algorithm>
#include <string>

#include "core/text.h"
#include "image/format.h"
#include "image/integers.h"

namespace ewa::image {

namespace {

void require_pixels(const core::FileReader& reader, const Claim& claim, uint64_t row_bytes) {
    check_claim(reader, claim);
    reader.require_room(claim.height, row_bytes, "rows of pixels");
}

/// The next number of a PNM's header: white space and comments come before it, one white space after it.
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

Claim look_at_webp(core::FileReader& reader) {
    const char* const what = "the WebP's header";
    reader.skip(4, what);
    const auto length = reader.read<uint32_t>(what);
    reader.require_room(length, 1, "bytes of the WebP");
    reader.skip(4, what);
    const std::string type(reinterpret_cast<const char*>(reader.take(4, what)), 4);
    reader.skip(4, what);
    Claim claim{0, 0, 4, 1};
    const std::byte* data = reader.take(10, what);
    bool transparent = false;
    if (type == "VP8X") {
        if ((data[0] & std::byte(0x02)) != std::byte(0))
            reader.fail("the WebP is a film; a picture is wanted");
        transparent = (data[0] & std::byte(0x10)) != std::byte(0);
        claim.width = little_endian(data + 4, 3) + 1;
        claim.height = little_endian(data + 7, 3) + 1;
    } else if (type == "VP8L") {
        const uint64_t sizes = little_endian(data + 1, 4);
        claim.width = (sizes & 0x3fff) + 1;
        claim.height = (sizes >> 14 & 0x3fff) + 1;
        transparent = (sizes >> 28 & 1) != 0;
    } else if (type == "VP8 ") {
        claim.width = little_endian(data + 6, 2) & 0x3fff;
        claim.height = little_endian(data + 8, 2) & 0x3fff;
    } else {
        reader.fail("the WebP begins with no picture");
    }
    // OpenImageIO multiplies colour by alpha there, whatever it is asked.
    if (transparent) reader.fail("the WebP is transparent; convert it to PNG");
    check_claim(reader, claim);
    return claim;
}

Claim look_at_bmp(core::FileReader& reader) {
    const char* const what = "the BMP's header";
    reader.skip(10, what);
    const auto offset = reader.read<uint32_t>(what), header = reader.read<uint32_t>(what);
    if (header < 40) reader.fail("the BMP is of a kind from before 1990");
    const std::byte* data = reader.take(16, what);
    const auto width = static_cast<int32_t>(little_endian(data, 4)),
               height = static_cast<int32_t>(little_endian(data + 4, 4));
    const uint64_t bits = little_endian(data + 10, 2), packing = little_endian(data + 12, 4);
    // Pixels as they are, or with masks that say where in 16 or 32 bits a colour lies.
    if (packing != 0 && packing != 3) reader.fail("the BMP is run-length coded; save it uncompressed");
    if (bits != 8 && bits != 24 && bits != 32)
        reader.fail("the BMP has " + std::to_string(bits) + " bits a pixel, not 8, 24 or 32");
    // A negative height says that the first row is the top one.
    const auto rows = static_cast<uint64_t>(std::abs(int64_t(height)));
    const Claim claim{static_cast<uint64_t>(std::max(width, 0)), rows, bits == 32 ? uint64_t(4) : 3, 1};
    reader.go_to(offset, "the BMP's pixels");
    require_pixels(reader, claim, (claim.width * bits + 31) / 32 * 4);
    return claim;
}

Claim look_at_pnm(core::FileReader& reader) {
    const bool color = reader.take(2, "the signature")[1] == std::byte('6');
    Claim claim{0, 0, color ? uint64_t(3) : 1, 1};
    claim.width = pnm_number(reader);
    claim.height = pnm_number(reader);
    const uint64_t largest = pnm_number(reader);
    // Others OpenImageIO scales in ways that lose the last bit.
    if (largest != 255)
        reader.fail("the PNM's largest value is " + std::to_string(largest) + ", not 255; convert it to PNG");
    require_pixels(reader, claim, claim.width * claim.channels);
    return claim;
}

Claim look_at_hdr(core::FileReader& reader) {
    constexpr size_t kMaxLine = 4096;
    std::string line;
    do {
        if (!reader.read_line(line, kMaxLine)) reader.fail("the HDR's header ends too soon");
    } while (!line.empty());
    reader.read_line(line, kMaxLine);
    std::string_view rest = line;
    const std::string_view y = core::next_word(rest), rows = core::next_word(rest), x = core::next_word(rest),
                           columns = core::next_word(rest);
    const auto height = core::parse_integer<uint32_t>(rows), width = core::parse_integer<uint32_t>(columns);
    if (y != "-Y" || x != "+X" || !height || !width)
        reader.fail("the HDR's size is not written as -Y height +X width");
    const Claim claim{*width, *height, 3, sizeof(float)};
    check_claim(reader, claim);
    return claim;
}

}  // namespace ewa::image
