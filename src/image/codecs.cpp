// SPDX-License-Identifier: Apache-2.0
#include "image/codecs.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>

namespace ewa::image {

namespace {

using namespace std::string_view_literals;

// TIFF has either byte order. The version 43 instead of 42 means 64-bit offsets.
constexpr Format kFormats[] = {
    {"\x89PNG\r\n\x1a\n"sv, "png"},
    {"\xff\xd8\xff"sv, "jpeg"},
    {"II\x2a\0"sv, "tiff", probe_tiff},
    {"MM\0\x2a"sv, "tiff", probe_tiff},
    {"II\x2b\0"sv, "tiff", probe_tiff},
    {"MM\0\x2b"sv, "tiff", probe_tiff},
    {"\x76\x2f\x31\x01"sv, "openexr", probe_exr},
    {"RIFF"sv, "webp", probe_webp},
    {"BM"sv, "bmp", probe_bmp},
    {"P5"sv, "pnm", probe_pnm},
    {"P6"sv, "pnm", probe_pnm},
    {"#?RADIANCE"sv, "hdr", nullptr},
    {"#?RGBE"sv, "hdr", nullptr},
};

}  // namespace

const Format* format_of(std::string_view first_bytes) {
    const auto* found = std::find_if(std::begin(kFormats), std::end(kFormats), [&](const Format& format) {
        return first_bytes.starts_with(format.signature);
    });
    if (found == std::end(kFormats)) return nullptr;
    if (found->name == "webp" && (first_bytes.size() < 12 || first_bytes.substr(8, 4) != "WEBP"))
        return nullptr;
    return found;
}

void check_limits(const ImageHeader& header, uint64_t file_bytes) {
    if (header.width < 1 || header.height < 1 || header.channels < 1)
        throw std::runtime_error("its header describes a picture without pixels");
    const auto refuse = [&](const std::string& reason) {
        throw std::runtime_error("its header claims " + std::to_string(header.width) + " x " +
                                 std::to_string(header.height) + " pixels of " +
                                 std::to_string(header.channels) + " channels, " + reason);
    };
    if (header.width > kMaxSide || header.height > kMaxSide)
        refuse("more than " + std::to_string(kMaxSide) + " in a direction");
    const uint64_t pixels = header.width * header.height;
    if (pixels > kMaxPixels)
        refuse("more than " + std::to_string(kMaxPixels / 1'000'000) +
               " million pixels; make the picture smaller");
    if (header.channels > kMaxChannels ||
        pixels * header.channels * header.bytes_per_value > kMaxDecodedBytes)
        refuse("more than " + std::to_string(kMaxDecodedBytes >> 30) + " GiB or " +
               std::to_string(kMaxChannels) + " channels; keep only its colour");
    const uint64_t bytes = pixels * header.channels * sizeof(float);
    if (bytes > kUncheckedBytes && bytes / kMaxCompression > file_bytes)
        refuse("too many for its " + std::to_string(file_bytes) + " bytes");
}

uint64_t big_endian(const std::byte* bytes, int count) {
    uint64_t value = 0;
    for (int i = 0; i < count; ++i) value = value << 8 | std::to_integer<uint64_t>(bytes[i]);
    return value;
}

uint64_t little_endian(const std::byte* bytes, int count) {
    uint64_t value = 0;
    for (int i = count; i-- > 0;) value = value << 8 | std::to_integer<uint64_t>(bytes[i]);
    return value;
}

int exif_orientation(const void* exif, uint64_t size) {
    constexpr uint64_t kTag = 274, kEntryBytes = 12;
    const auto* bytes = static_cast<const std::byte*>(exif);
    const auto number = [&](uint64_t at, int count) -> uint64_t {
        if (at + uint64_t(count) > size) return 0;
        return bytes[0] == std::byte('M') ? big_endian(bytes + at, count) : little_endian(bytes + at, count);
    };
    const uint64_t directory = number(4, 4), count = number(directory, 2);
    for (uint64_t i = 0; i < count; ++i) {
        const uint64_t entry = directory + 2 + i * kEntryBytes;
        if (number(entry, 2) == kTag) return int(number(entry + 8, 2));
    }
    return 1;
}

}  // namespace ewa::image
