// SPDX-License-Identifier: Apache-2.0
// Any bytes as a picture: what is looked at before a codec sees the file keeps to the limits of pictures, or
// says in one line what is wrong; and PNGs that pass are decoded.
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <string>

#include "ewa/error.h"
#include "image/format.h"
#include "image/png_file.h"
#include "input.h"

namespace {

using namespace ewa;

constexpr size_t kPngSignature = 8, kPngLength = 4, kPngFrame = 12;  // length, type and checksum of a chunk
constexpr uint64_t kDecodedPixels = 1 << 16;

/// Gives each chunk of a PNG its checksum, which is what mutations would end at otherwise.
void sum_chunks(std::string& bytes) {
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

void check_claim(const image::Claim& claim) {
    const std::string text = std::to_string(claim.width) + " x " + std::to_string(claim.height) + " x " +
                             std::to_string(claim.channels);
    EWA_REQUIRE(claim.width >= 1 && claim.width <= image::kMaxSide);
    EWA_REQUIRE(claim.height >= 1 && claim.height <= image::kMaxSide);
    EWA_REQUIRE(claim.width * claim.height <= image::kMaxPixels);
    EWA_REQUIRE(claim.channels >= 1 && claim.channels <= image::kMaxChannels);
}

void read_picture(const std::string& path, size_t size, bool whole) {
    const std::string text = whole ? "the whole file" : "the header alone";
    image::Claim claim;
    image::Format format{};
    // What is looked at takes no memory by what the file claims.
    fuzz::read_within(size, 1, [&] {
        core::FileReader reader(path);
        format = image::format_of(reader);
        claim = image::look_at(reader, format, whole);
    });
    check_claim(claim);
    if (format != image::Format::png || claim.width * claim.height > kDecodedPixels) return;
    image::PngPicture png;
    fuzz::read_within(size, 1, [&] { png = image::read_png(path, whole); });
    EWA_REQUIRE(uint64_t(png.size.width) == claim.width && uint64_t(png.size.height) == claim.height);
    EWA_REQUIRE(png.channels >= 1 && png.channels <= 4);
    EWA_REQUIRE(png.values.size() == (whole ? claim.width * claim.height * uint64_t(png.channels) : 0));
    EWA_REQUIRE(std::ranges::all_of(png.values, [](float v) { return v >= 0 && v <= 1; }));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static fuzz::MemoryFile file;
    std::string bytes(reinterpret_cast<const char*>(data), size);
    sum_chunks(bytes);
    const std::string& path = file.hold(reinterpret_cast<const uint8_t*>(bytes.data()), size);
    for (const bool whole : {false, true}) try {
            read_picture(path, size, whole);
        } catch (const InputError& error) {
            const std::string text = error.what();
            EWA_REQUIRE(text.starts_with(path));
            EWA_REQUIRE(text.find('\n') == std::string::npos && text.size() < 2000);
        }
    return 0;
}
