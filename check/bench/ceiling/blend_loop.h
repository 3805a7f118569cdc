// SPDX-License-Identifier: Apache-2.0
// Blending in plain C++ with CPU vectors: the loop of shaders/passes/blend.comp, whose time the pass is
// compared with. It uses the records and sorted lists of the device, so that both do the same work.
#pragma once
#include <cstdint>

namespace ewa::bench {

/// The lists of one frame, downloaded from the device. A tile has 64 pixels, or some times as many side by side.
struct BlendLists {
    const float* records = nullptr;         // 12 floats per splat, as in shaders/shared/layouts.h
    const std::uint32_t* splats = nullptr;  // of each sorted instance
    const std::uint32_t* tile_starts = nullptr;
    std::uint32_t width = 0, height = 0;                         // px
    std::uint32_t tile_width = 8, tile_height = 8, tiles_x = 0;  // px; tiles
    float background[3] = {0, 0, 0};
};

/// Numbers of (pixel, splat) pairs. evaluated: the list entries that pixels read, the saturating one included.
struct PairCounts {
    std::uint64_t evaluated = 0, blended = 0;
};

/// Blends one tile into 4 planes (R, G, B, transmittance) of width * height floats.
using BlendTile = void (*)(const BlendLists& lists, std::uint32_t tile, float* planes);

void blend_tile_avx512(const BlendLists& lists, std::uint32_t tile, float* planes);
void blend_tile_avx2(const BlendLists& lists, std::uint32_t tile, float* planes);
void blend_tile_portable(const BlendLists& lists, std::uint32_t tile, float* planes);

/// Without fused multiply-add, so that the counts of the same lists are the same on every machine.
PairCounts count_tile(const BlendLists& lists, std::uint32_t tile);

}  // namespace ewa::bench
