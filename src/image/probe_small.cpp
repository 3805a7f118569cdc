// SPDX-License-Identifier: Apache-2.0
// The probes of the formats with a short header. Radiance HDR needs none: OpenImageIO opens it without taking
// memory for its pixels.
#include <algorithm>
#include <cstdlib>
#include <string>

#include "core/text.h"
#include "image/codecs.h"

namespace ewa::image {

namespace {

/// The next number of a PNM's header. White space and comments precede it, and one white space follows.
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

void probe_webp(core::FileReader& reader) {
    const char* const what = "the WebP's header";
    reader.skip(4, what);
    reader.require_room(reader.read<uint32_t>(what), 1, "bytes of the WebP");
    const std::byte* data = reader.take(22, what);
    const std::string type(reinterpret_cast<const char*>(data + 4), 4);
    const std::byte* header = data + 12;
    ImageHeader image{0, 0, 4, 1};
    bool transparent = false;
    if (type == "VP8X") {
        if ((header[0] & std::byte(0x02)) != std::byte(0))
            reader.fail("the WebP is a film; a picture is wanted");
        transparent = (header[0] & std::byte(0x10)) != std::byte(0);
        image.width = little_endian(header + 4, 3) + 1;
        image.height = little_endian(header + 7, 3) + 1;
    } else if (type == "VP8L") {
        const uint64_t sizes = little_endian(header + 1, 4);
        image.width = (sizes & 0x3fff) + 1;
        image.height = (sizes >> 14 & 0x3fff) + 1;
        transparent = (sizes >> 28 & 1) != 0;
    } else if (type == "VP8 ") {
        image.width = little_endian(header + 6, 2) & 0x3fff;
        image.height = little_endian(header + 8, 2) & 0x3fff;
    } else {
        reader.fail("the WebP begins with no picture");
    }
    // OpenImageIO multiplies the colour of a WebP by its alpha, whatever it is asked.
    if (transparent) reader.fail("the WebP is transparent; convert it to PNG");
    check_limits(image, reader.size());
}

/// OpenImageIO would unpack a run-length coded BMP when it opens it, before its size is checked.
void probe_bmp(core::FileReader& reader) {
    const std::byte* header = reader.take(34, "the BMP's header");
    if (little_endian(header + 14, 4) < 40) reader.fail("the BMP is of a kind from before 1990");
    const uint64_t bits = little_endian(header + 28, 2), packing = little_endian(header + 30, 4);
    // Pixels as they are, or with masks that say where the colours are in 16 or 32 bits.
    if (packing != 0 && packing != 3) reader.fail("the BMP is run-length coded; save it uncompressed");
    if (bits != 8 && bits != 24 && bits != 32)
        reader.fail("the BMP has " + std::to_string(bits) + " bits a pixel, not 8, 24 or 32");
    // A negative height means that the first row is the top one.
    const auto width = static_cast<int32_t>(little_endian(header + 18, 4)),
               height = static_cast<int32_t>(little_endian(header + 22, 4));
    const uint64_t offset = little_endian(header + 10, 4), rows = uint64_t(std::abs(int64_t(height)));
    const ImageHeader image{uint64_t(std::max(width, 0)), rows, bits == 32 ? uint64_t(4) : 3, 1};
    check_limits(image, reader.size());
    reader.go_to(offset, "the BMP's pixels");
    reader.require_room(rows, (image.width * bits + 31) / 32 * 4, "rows of pixels");
}

/// OpenImageIO reads the pixels of a PNM when it opens it. It also rescales values that end at another number
/// than 255, and rounds them.
void probe_pnm(core::FileReader& reader) {
    const uint64_t channels = reader.take(2, "the signature")[1] == std::byte('6') ? 3 : 1;
    const uint64_t width = pnm_number(reader), height = pnm_number(reader), largest = pnm_number(reader);
    if (largest != 255)
        reader.fail("the PNM's largest value is " + std::to_string(largest) + ", not 255; convert it to PNG");
    check_limits({width, height, channels, 1}, reader.size());
    reader.require_room(height, width * channels, "rows of pixels");
}

}  // namespace ewa::image
