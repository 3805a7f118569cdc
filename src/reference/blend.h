// SPDX-License-Identifier: Apache-2.0
// Front-to-back compositing of each pixel over its tile's list (Kerbl et al. 2023, eq. 3):
//   colour = sum_i c_i alpha_i T_i + T background,  T_i = prod_{j < i} (1 - alpha_j)
//   depth  = sum_i z_i alpha_i T_i
// It stops before the splat that would lower T to TRANSMITTANCE_STOP or below. Two opaque splats leave (1 -
// ALPHA_MAX)^2, which equals TRANSMITTANCE_STOP, so the second is skipped: 0.01 of its colour. Float32 has
// this result, as T * (1 - alpha). In float64, the product rounds to slightly above, hence kStopMargin.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "reference/instances.h"
#include "reference/values.h"
#include "shared/constants.h"

namespace ewa::reference {

struct Blended {
    Raster color;                     // RGB with background, not clamped
    Raster transmittance;             // T after the last splat
    Raster depth_sum;                 // sum z alpha T
    Raster depth;                     // depth_sum / (1 - T) where 1 - T > 0, else 0
    std::vector<uint32_t> evaluated;  // per pixel: evaluated list entries, including the one that stopped it
    std::vector<uint32_t> blended;    // per pixel: contributing list entries
};

Blended blend(std::span<const Projected> projected, const Instances& instances,
              const std::array<float, 3>& background, const Smoothing& smoothing = {});

/// A relative margin, above the rounding of a few factors in float64 and far below a float32 step.
inline constexpr double kStopMargin = 1e-13;

inline bool stops(double next_transmittance) {
    return next_transmittance <= shared::TRANSMITTANCE_STOP * (1 + kStopMargin);
}

/// The contribution of one splat to one pixel.
struct Contribution {
    size_t instance = 0;  // index into instances.sorted
    uint32_t splat = 0;
    Sample sample;
    Alpha alpha;
    double transmittance = 1;  // before the splat
};

/// Calls visit(Contribution) for each contribution to a pixel, front to back, and returns the number of
/// evaluated list entries. Both directions use it. There is one whitener per splat.
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

// The backward pass of compositing: from dL/d(image) to each splat's footprint and colour.
//
// With S the colour behind splat i (background included), S = C - sum_{j <= i} c_j alpha_j T_j:
//   dL/dc_i     = sum over pixels of dL/dC alpha_i T_i
//   dL/dalpha_i = dL/dC . (c_i T_i - S / (1 - alpha_i))        1 - alpha >= 1 - ALPHA_MAX
//   g           = dL/dpower = dL/dalpha alpha                  zero where alpha is clamped at ALPHA_MAX
// S comes from front-to-back prefixes, so T is never divided out.
//
// With w = (u, v)^T = L d (see instances.h), the power -w.w/2 has
//   dpower/dmean2d = L^T w,  dpower/dSigma = L^T w w^T L / 2,  dpower/dopacity = 1 / opacity
// So a splat's gradient needs only the moments of g over its pixels, which add up over tiles:
//   dL/dmean2d = L^T (Su, Sv),  dL/dSigma = L^T [Suu Suv; Suv Svv] L / 2,  dL/dopacity = S0 / opacity

/// Sums over the pixels of one (splat, tile) instance.
struct Moments {
    double s0 = 0, su = 0, sv = 0, suu = 0, suv = 0, svv = 0;  // of g times 1, u, v, uu, uv, vv
    glm::dvec3 color{0};                                       // dL/dcolour
    glm::dvec2 absolute{0};                                    // sum of |dL/dmean2d|, by component
    Moments& operator+=(const Moments& other);
};

ScreenGradient screen_gradient(const Projected& splat, const Moments& moments);

struct BlendGradients {
    std::vector<Moments> instances;      // per entry of instances.sorted
    std::vector<ScreenGradient> splats;  // per splat; its tiles are added in ascending order
};

/// `blended` is blend()'s result for the same arguments, `picture_gradient` is dL/dcolour of each pixel
/// (RGB).
BlendGradients blend_backward(std::span<const Projected> projected, const Instances& instances,
                              const Blended& blended, const Raster& picture_gradient,
                              const Smoothing& smoothing = {});

/// Renders splats as solids. A pixel shows the nearest splat, by its mean's depth, with an opacity of at
/// least ELLIPSOID_OPACITY whose ellipse contains the pixel. The ellipse has ELLIPSOID_REACH standard
/// deviations, including the low-pass. With the distance d in standard deviations, the colour is multiplied
/// by ELLIPSOID_RIM + (1 - ELLIPSOID_RIM) sqrt(1 - (d / reach)^2), a sphere lit from the eye. The result is
/// RGB.
Raster ellipsoids(std::span<const Projected> projected, const Instances& instances,
                  const std::array<float, 3>& background);

}  // namespace ewa::reference
