// SPDX-License-Identifier: Apache-2.0
#include "image/limits.h"

#include <string>

namespace ewa::image {

void check_claim(const core::FileReader& reader, const Claim& claim) {
    if (claim.width < 1 || claim.height < 1 || claim.channels < 1)
        reader.fail("the header's picture has no pixels");
    const std::string claims = "the header claims " + std::to_string(claim.width) + " x " +
                               std::to_string(claim.height) + " pixels of " + std::to_string(claim.channels) +
                               " channels, ";
    if (claim.width > kMaxSide || claim.height > kMaxSide)
        reader.fail(claims + "more than " + std::to_string(kMaxSide) + " in a direction");
    const uint64_t pixels = claim.width * claim.height;
    if (pixels > kMaxPixels)
        reader.fail(claims + "more than " + std::to_string(kMaxPixels / 1'000'000) +
                    " million pixels; make the picture smaller");
    if (claim.channels > kMaxChannels || pixels * claim.channels * claim.bytes_per_value > kMaxDecodedBytes)
        reader.fail(claims + "more than " + std::to_string(kMaxDecodedBytes >> 30) + " GiB or " +
                    std::to_string(kMaxChannels) + " channels; keep only its colour");
    const uint64_t bytes = pixels * claim.channels * sizeof(float);
    if (bytes > kUncheckedBytes && bytes / kMaxCompression > reader.size())
        reader.fail(claims + "too many for its " + std::to_string(reader.size()) + " bytes");
}

}  // namespace ewa::image
