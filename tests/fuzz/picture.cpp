// SPDX-License-Identifier: Apache-2.0
// Any bytes as a picture. A PNG or JPEG is decoded; of every other format its probe is run. Each keeps to the
// limits of pictures, or says in one line what is wrong.
#include <algorithm>
#include <cstdio>
#include <string>

#include "ewa/error.h"
#include "image/image_files.h"
#include "input.h"
#include "png.h"

namespace {

using namespace ewa;

constexpr uint64_t kDecodedPixels = 1 << 16;

void check_size(const ImageSize& size) {
    const std::string text = std::to_string(size.width) + " x " + std::to_string(size.height);
    EWA_REQUIRE(size.width >= 1 && uint64_t(size.width) <= image::kMaxSide);
    EWA_REQUIRE(size.height >= 1 && uint64_t(size.height) <= image::kMaxSide);
    EWA_REQUIRE(uint64_t(size.width) * uint64_t(size.height) <= image::kMaxPixels);
}

/// A PNG or JPEG in a stream: its header, and its pixels where they are few.
template <class Read>
void decode(const std::string& bytes, const Read& read) {
    const auto run = [&](bool pixels) {
        // The codec sees a file, as it does in ewa.
        std::FILE* file = fmemopen(const_cast<char*>(bytes.data()), bytes.size(), "r");
        image::StoredImage image;
        try {
            fuzz::read_within(bytes.size(), 1, [&] { image = read(file, bytes.size(), pixels); });
        } catch (...) {
            std::fclose(file);
            throw;
        }
        std::fclose(file);
        return image;
    };
    const image::StoredImage header = run(false);
    check_size(header.size);
    if (uint64_t(header.size.width) * uint64_t(header.size.height) > kDecodedPixels) return;
    const image::StoredImage image = run(true);
    const std::string text = "the decoded picture";
    EWA_REQUIRE(image.size.width == header.size.width && image.size.height == header.size.height);
    EWA_REQUIRE(image.channels == header.channels && image.channels >= 1 && image.channels <= 4);
    EWA_REQUIRE(image.values.size() ==
                size_t(image.size.width) * size_t(image.size.height) * size_t(image.channels));
    EWA_REQUIRE(std::ranges::all_of(image.values, [](float v) { return v >= 0 && v <= 1; }));
}

void read_picture(const std::string& path, const std::string& bytes) {
    const image::Format* format = image::format_of(bytes);
    if (!format) return;
    if (format->read) return decode(bytes, format->read);
    if (!format->probe) return;
    // A probe takes no memory by what the file claims.
    fuzz::read_within(bytes.size(), 1, [&] {
        core::FileReader reader(path);
        format->probe(reader);
    });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static fuzz::MemoryFile file;
    std::string bytes(reinterpret_cast<const char*>(data), size);
    fuzz::sum_png_chunks(bytes);
    const std::string& path = file.hold(reinterpret_cast<const uint8_t*>(bytes.data()), size);
    try {
        read_picture(path, bytes);
    } catch (const std::runtime_error& error) {
        const std::string text = error.what();
        EWA_REQUIRE(text.find('\n') == std::string::npos && text.size() < 2000);
    }
    return 0;
}
