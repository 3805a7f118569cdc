// SPDX-License-Identifier: Apache-2.0
// Compiled with -mavx2 -mfma: 8 pixels a vector.
#define EWA_BENCH_LANES 8
#include "bench/ceiling/blend_loop.inc"

namespace ewa::bench {

void blend_tile_avx2(const BlendLists& lists, std::uint32_t tile, float* planes) {
    blend_whole_tile(lists, tile, planes);
}

}  // namespace ewa::bench
