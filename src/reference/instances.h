// SPDX-License-Identifier: Apache-2.0
// The alpha of a splat at a pixel, and the lists of splats that each tile blends.
//
//   d = pixel centre - mean2d
//   u = (c d.x - b d.y) / sqrt(c det),  v = d.y / sqrt(c),  power = -(u^2 + v^2) / 2
//   raw alpha = opacity exp(power),  alpha = min(ALPHA_MAX, raw), 0 below ALPHA_MIN
//
// (u, v) = L d, where L is the Cholesky factor of the inverse covariance L^T L. So the power equals the
// quadratic form of Kerbl et al. 2023, eq. 4, but as a sum of squares it cannot cancel.
#pragma once
#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "reference/projection.h"

namespace ewa::reference {

/// The cut of alpha at ALPHA_MIN. The model's hard cut makes an image jump as a splat moves, which a central
/// difference cannot distinguish from a gradient. The other two are for such tests.
enum class AlphaCut {
    hard,  // 0 below ALPHA_MIN
    ramp,  // times a C1 step from 0 at ALPHA_MIN to 1 at 2 ALPHA_MIN
    none,  // 0 below 1e-18
};

struct Smoothing {
    AlphaCut cut = AlphaCut::hard;
    bool transmittance_stop = true;  // blending stops at TRANSMITTANCE_STOP
};

/// The smallest raw alpha of a contribution.
double alpha_floor(const Smoothing& smoothing);

struct Alpha {
    bool kept = false;
    double value = 0;
    double slope = 0;  // d value / d raw: zero where the clamp to ALPHA_MAX is active
};
Alpha alpha_of(double raw, const Smoothing& smoothing);

/// L = [ux uy; 0 vy].
struct Whitener {
    double ux = 0, uy = 0, vy = 0;
};
Whitener whitener(const Projected& splat);

struct Sample {
    double u = 0, v = 0;
    double raw = 0;  // raw alpha
};
inline glm::dvec2 pixel_centre(int x, int y) {
    return {x + 0.5, y + 0.5};
}
Sample sample(const Projected& splat, const Whitener& whitener, const glm::dvec2& pixel);

// Tiles list a splat if at least one of their pixel centres has a raw alpha of ALPHA_MIN or more. A shorter
// list would change the image, and a longer one would only cost time. The tiles are found by testing the
// pixels in the footprint's box: |d.x| <= r sqrt(a), |d.y| <= r sqrt(c) with r = sqrt(2 ln(opacity /
// ALPHA_MIN)).

struct TileGrid {
    int image_width = 0, image_height = 0;  // px
    int tile_width = 16, tile_height = 16;  // px; the last column and row may exceed the image

    int columns() const { return (image_width + tile_width - 1) / tile_width; }
    int rows() const { return (image_height + tile_height - 1) / tile_height; }
    uint32_t count() const { return uint32_t(columns() * rows()); }
    uint32_t tile_of(int x, int y) const { return uint32_t((y / tile_height) * columns() + x / tile_width); }
};

/// The tiles of a splat in ascending order, row by row. Empty for a splat that is invisible or outside the
/// image.
std::vector<uint32_t> covered_tiles(const Projected& splat, const TileGrid& grid,
                                    const Smoothing& smoothing = {});

struct Instance {
    uint32_t tile = 0, splat = 0;
    bool operator==(const Instance&) const = default;
};

struct Instances {
    TileGrid grid;
    std::vector<uint64_t> first_of_rank;  // first instance of each splat before the sort, in depth order
    std::vector<Instance> sorted;         // by tile, front to back within a tile
    std::vector<uint64_t> first_of_tile;  // count() + 1 bounds into sorted
};

/// `order` is depth_order's result.
Instances make_instances(std::span<const Projected> projected, std::span<const uint32_t> order,
                         const TileGrid& grid, const Smoothing& smoothing = {});

}  // namespace ewa::reference
