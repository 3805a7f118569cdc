// SPDX-License-Identifier: Apache-2.0
// How large a picture may be. A few bytes can claim, and a well-packed file can hold, pictures that fill any
// machine's memory; what a header claims is held against these before anything is decoded.
#pragma once
#include <cstdint>

#include "core/file_reader.h"

namespace ewa::image {

/// The largest sensors of cameras and telephones have 150 to 200 million pixels. In memory a value is a
/// float: a picture of three channels then takes 2.4 GB, and decoding it some seconds.
constexpr uint64_t kMaxPixels = 200'000'000;
/// JPEG's largest, in either direction: a codec's tables by row or column stay small.
constexpr uint64_t kMaxSide = 65'535;
/// As OpenImageIO's own limit; layers of a rendering are channels of one EXR file.
constexpr uint64_t kMaxChannels = 1024;
/// All channels of the file, decoded; OpenImageIO has the same limit.
constexpr uint64_t kMaxDecodedBytes = uint64_t(4) << 30;
/// Codecs hold some tiles at once, whole.
constexpr uint64_t kMaxTilePixels = 4096 * 4096;
/// Each scan of a progressive JPEG goes over the whole picture, however few its bytes; encoders write about
/// ten.
constexpr int kMaxJpegScans = 100;
/// A picture of more bytes than the first has to have a file that could hold it: what formats compress best,
/// a single colour, stays under this ratio.
constexpr uint64_t kUncheckedBytes = uint64_t(256) << 20;
constexpr uint64_t kMaxCompression = 5000;

/// What a header says.
struct Claim {
    uint64_t width = 0, height = 0, channels = 0;
    uint64_t bytes_per_value = 1;
};

/// Throws InputError where the claim is none of a picture or is beyond a limit.
void check_claim(const core::FileReader& reader, const Claim& claim);

}  // namespace ewa::image
