// SPDX-License-Identifier: Apache-2.0
#include "image/format.h"

#include <algorithm>
#include <string_view>

#include "ewa/error.h"

namespace ewa::image {

namespace {

using namespace std::string_view_literals;

struct Signature {
    std::string_view bytes;
    Format format;
};

// A TIFF is of either byte order and, with 43 for 42, of 64-bit offsets.
constexpr Signature kSignatures[] = {
    {"\x89PNG\r\n\x1a\n"sv, Format::png},
    {"\xff\xd8\xff"sv, Format::jpeg},
    {"II\x2a\0"sv, Format::tiff},
    {"MM\0\x2a"sv, Format::tiff},
    {"II\x2b\0"sv, Format::tiff},
    {"MM\0\x2b"sv, Format::tiff},
    {"\x76\x2f\x31\x01"sv, Format::exr},
    {"RIFF"sv, Format::webp},
    {"BM"sv, Format::bmp},
    {"P5"sv, Format::pnm},
    {"P6"sv, Format::pnm},
    {"#?RADIANCE"sv, Format::hdr},
    {"#?RGBE"sv, Format::hdr},
};

}  // namespace

Format format_of(core::FileReader& reader) {
    const size_t size = static_cast<size_t>(std::min<uint64_t>(reader.size(), 16));
    const std::string_view bytes(reinterpret_cast<const char*>(reader.take(size, "the signature")), size);
    const auto* found = std::find_if(std::begin(kSignatures), std::end(kSignatures), [&](const Signature& s) {
        return bytes.starts_with(s.bytes) &&
               (s.format != Format::webp || (size >= 12 && bytes.substr(8, 4) == "WEBP"));
    });
    if (found == std::end(kSignatures))
        throw InputError(reader.name() +
                         ": not a readable image: its first bytes are none of a PNG, JPEG, TIFF, EXR, WebP, "
                         "BMP, binary PPM or PGM, or Radiance HDR file; convert it to one of these");
    reader.go_to(0, "the file");
    return found->format;
}

Claim look_at(core::FileReader& reader, Format format, bool whole) {
    switch (format) {
        case Format::png:
            return look_at_png(reader, whole);
        case Format::jpeg:
            return look_at_jpeg(reader, whole);
        case Format::tiff:
            return look_at_tiff(reader);
        case Format::exr:
            return look_at_exr(reader);
        case Format::webp:
            return look_at_webp(reader);
        case Format::bmp:
            return look_at_bmp(reader);
        case Format::pnm:
            return look_at_pnm(reader);
        case Format::hdr:
            return look_at_hdr(reader);
    }
    return {};
}

}  // namespace ewa::image
