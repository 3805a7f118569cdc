// SPDX-License-Identifier: Apache-2.0
// Which splats each tile of the picture blends, front to back.
//
// A splat is listed for exactly the tiles in which at least one pixel centre has a raw alpha of ALPHA_MIN or
// more, so a list without it would change the picture and a list with more would only cost time. Found by
// trying the pixels of the footprint's box: |d.x| <= r sqrt(a), |d.y| <= r sqrt(c) with r = sqrt(2 ln(opacity
// / ALPHA_MIN)).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "reference/footprint.h"
#include "reference/projection.h"

namespace ewa::reference {

struct TileGrid {
    int image_width = 0, image_height = 0;  // px
    int tile_width = 16, tile_height = 16;  // px; the last column and row may hang over

    int columns() const { return (image_width + tile_width - 1) / tile_width; }
    int rows() const { return (image_height + tile_height - 1) / tile_height; }
    uint32_t count() const { return uint32_t(columns() * rows()); }
    uint32_t tile_of(int x, int y) const { return uint32_t((y / tile_height) * columns() + x / tile_width); }
};

/// Ascending, row by row. Empty for a splat that is not visible or lies off the picture.
std::vector<uint32_t> covered_tiles(const Projected& splat, const TileGrid& grid,
                                    const Smoothing& smoothing = {});

struct Instance {
    uint32_t tile = 0, splat = 0;
    bool operator==(const Instance&) const = default;
};

struct Instances {
    TileGrid grid;
    std::vector<uint64_t>
        first_of_rank;             // exclusive scan over the depth order: a splat's instances before the sort
    std::vector<Instance> sorted;  // by tile, front to back within a tile
    std::vector<uint64_t> first_of_tile;  // count() + 1 bounds into sorted
};

/// order: from depth_order.
Instances make_instances(std::span<const Projected> projected, std::span<const uint32_t> order,
                         const TileGrid& grid, const Smoothing& smoothing = {});

}  // namespace ewa::reference
