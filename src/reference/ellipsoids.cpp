// SPDX-License-Identifier: Apache-2.0
#include "reference/ellipsoids.h"

#include <cmath>

#include "reference/blend.h"

namespace ewa::reference {

Raster ellipsoids(std::span<const Projected> projected, const Instances& instances,
                  const std::array<float, 3>& background) {
    const TileGrid& grid = instances.grid;
    Raster out(grid.image_width, grid.image_height, 3);
    const std::vector<Whitener> whiteners = whiteners_of(projected);
    for (int y = 0; y < out.height; ++y)
        for (int x = 0; x < out.width; ++x) {
            for (int c = 0; c < 3; ++c) out.at(x, y)[c] = background[size_t(c)];
            const uint32_t tile = grid.tile_of(x, y);
            for (size_t k = instances.first_of_tile[tile]; k < instances.first_of_tile[tile + 1]; ++k) {
                const uint32_t splat = instances.sorted[k].splat;
                const Sample s = sample(projected[splat], whiteners[splat], pixel_centre(x, y));
                const double height =
                    1 - (s.u * s.u + s.v * s.v) / (shared::ELLIPSOID_REACH * shared::ELLIPSOID_REACH);
                if (height < 0 || projected[splat].opacity < shared::ELLIPSOID_OPACITY) continue;
                const double shade = shared::ELLIPSOID_RIM + (1 - shared::ELLIPSOID_RIM) * std::sqrt(height);
                for (int c = 0; c < 3; ++c) out.at(x, y)[c] = shade * projected[splat].color[c];
                break;
            }
        }
    return out;
}

}  // namespace ewa::reference
