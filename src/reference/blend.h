// SPDX-License-Identifier: Apache-2.0
// Front-to-back compositing of each pixel over its tile's list (Kerbl et al. 2023, eq. 3):
//   colour = sum_i c_i alpha_i T_i + T background,  T_i = prod_{j < i} (1 - alpha_j)
//   depth  = sum_i z_i alpha_i T_i
// It stops before T would fall to TRANSMITTANCE_STOP or under; the splat that would do it is left out. Two
// opaque splats leave (1 - ALPHA_MAX)^2, which is TRANSMITTANCE_STOP itself: the second is left out, worth
// 0.01 of its colour. So it comes out in float32, as T * (1 - alpha); in float64 the product rounds to a
// little above, hence kStopMargin.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "reference/footprint.h"
#include "reference/instances.h"
#include "reference/values.h"
#include "shared/constants.h"

namespace ewa::reference {

struct Blended {
    Raster color;                     // RGB with background, not clamped
    Raster transmittance;             // what is left of T
    Raster depth_sum;                 // sum z alpha T
    Raster depth;                     // depth_sum / (1 - T) where 1 - T > 0, else 0
    std::vector<uint32_t> evaluated;  // per pixel: list entries looked at, the one that stopped it included
    std::vector<uint32_t> blended;    // per pixel: those that contributed
};

Blended blend(std::span<const Projected> projected, const Instances& instances,
              const std::array<float, 3>& background, const Smoothing& smoothing = {});

/// Relative; above the rounding of a few factors in float64, far below a float32 step.
inline constexpr double kStopMargin = 1e-13;

inline bool stops(double next_transmittance) {
    return next_transmittance <= shared::TRANSMITTANCE_STOP * (1 + kStopMargin);
}

/// One splat's part in one pixel.
struct Contribution {
    size_t instance = 0;  // into instances.sorted
    uint32_t splat = 0;
    Sample sample;
    Alpha alpha;
    double transmittance = 1;  // before it
};

/// The rule of what a pixel blends, once for both directions: calls visit(Contribution) for each
/// contribution, front to back, and returns how many list entries it looked at. whiteners: one a splat.
template <class Visit>
uint32_t walk_pixel(std::span<const Projected> projected, std::span<const Whitener> whiteners,
                    const Instances& instances, int x, int y, const Smoothing& smoothing, Visit&& visit) {
    const uint32_t tile = instances.grid.tile_of(x, y);
    const size_t first = instances.first_of_tile[tile], end = instances.first_of_tile[tile + 1];
    double transmittance = 1;
    for (size_t k = first; k < end; ++k) {
        const uint32_t splat = instances.sorted[k].splat;
        Contribution c{
            k, splat, sample(projected[splat], whiteners[splat], pixel_centre(x, y)), {}, transmittance};
        c.alpha = alpha_of(c.sample.raw, smoothing);
        if (!c.alpha.kept) continue;
        const double next = transmittance * (1 - c.alpha.value);
        if (smoothing.transmittance_stop && stops(next)) return uint32_t(k + 1 - first);
        visit(c);
        transmittance = next;
    }
    return uint32_t(end - first);
}

std::vector<Whitener> whiteners_of(std::span<const Projected> projected);

}  // namespace ewa::reference
