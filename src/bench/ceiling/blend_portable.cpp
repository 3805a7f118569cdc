// SPDX-License-Identifier: Apache-2.0
// Compiled for the oldest CPU the program runs on, and without fused multiply-add. Also counts the pairs.
#define EWA_BENCH_LANES 8
#include "bench/ceiling/blend_loop.inc"

namespace ewa::bench {

void blend_tile_portable(const BlendLists& lists, std::uint32_t tile, float* planes) {
    blend_whole_tile(lists, tile, planes);
}

PairCounts count_tile(const BlendLists& lists, std::uint32_t tile) {
    PairCounts counts;
    for (unsigned first = 0; first < kTilePixels; first += kVectors * kLanes) {
        Pixels pixels;
        Int evaluated = {}, blended = {};
        open_pixels(pixels, lists, tile, first);
        walk<true>(pixels, lists, tile, evaluated, blended);
        for (unsigned l = 0; l < kLanes; ++l) {
            counts.evaluated += std::uint64_t(evaluated[l]);
            counts.blended += std::uint64_t(blended[l]);
        }
    }
    return counts;
}

}  // namespace ewa::bench
