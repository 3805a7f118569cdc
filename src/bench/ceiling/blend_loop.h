// SPDX-License-Identifier: Apache-2.0
// Blending in plain C++: the loop of shaders/passes/blend.comp on vectors of the CPU, the ceiling its speed
// is held against. It takes the device's own records and sorted lists, so that both do the same work.
#pragma once
#include <cstdint>

namespace ewa::bench {

/// One frame's lists as they come from the device. A tile holds 64 pixels.
struct BlendLists {
    const float* records = nullptr;         // 12 floats a splat, as in shaders/shared/layouts.h
    const std::uint32_t* splats = nullptr;  // of each sorted instance
    const std::uint32_t* tile_starts = nullptr;
    std::uint32_t width = 0, height = 0;  // px
    std::uint32_t tile_width = 8, tiles_x = 0;
    float background[3] = {0, 0, 0};
};

/// (pixel, splat) pairs. Evaluated: list entries a pixel looks at, the one that closes it included.
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
