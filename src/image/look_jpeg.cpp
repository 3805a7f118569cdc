// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "image/format.h"
#include "image/integers.h"

namespace ewa::image {

namespace {

constexpr uint32_t kEndOfImage = 0xd9, kStartOfScan = 0xda;

/// Start of frame of any coding; between them stand Huffman tables, an extension and arithmetic conditioning.
bool starts_frame(uint32_t marker) {
    return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}
bool in_many_scans(uint32_t frame) {
    return frame != 0xc0 && frame != 0xc1;
}

}  // namespace

Claim look_at_jpeg(core::FileReader& reader, bool whole) {
    const char* const what = "the JPEG's data (it is truncated)";
    reader.skip(2, what);  // start of image
    Claim claim;
    int scans = 0;
    for (uint32_t marker = 0xff;; marker = 0xff) {
        // Data stands only after a start of scan; markers may be padded with 0xff.
        while (reader.read<uint8_t>(what) != 0xff) {
        }
        while (marker == 0xff) marker = reader.read<uint8_t>(what);
        if (marker == kEndOfImage) break;
        // Neither a stuffed zero nor a restart marker has a length.
        if (marker == 0 || marker == 1 || (marker >= 0xd0 && marker <= 0xd7)) continue;
        auto length = static_cast<uint32_t>(big_endian(reader.take(2, what), 2));
        if (length < 2) reader.fail("the JPEG is damaged: a segment's length is too short");
        length -= 2;
        if (starts_frame(marker)) {
            if (length < 6) reader.fail("the JPEG is damaged: its frame's header is too short");
            const std::byte* frame = reader.take(6, what);
            claim = {big_endian(frame + 3, 2), big_endian(frame + 1, 2), big_endian(frame + 5, 1), 1};
            check_claim(reader, claim);
            // OpenImageIO reads all scans of what has several when it opens the file.
            if (!whole && !in_many_scans(marker)) return claim;
            length -= 6;
        }
        if (marker == kStartOfScan && ++scans > kMaxJpegScans)
            reader.fail("the JPEG has more than " + std::to_string(kMaxJpegScans) + " scans");
        reader.skip(length, what);
    }
    if (claim.width == 0) reader.fail("the JPEG has no frame");
    return claim;
}

}  // namespace ewa::image
