// SPDX-License-Identifier: Apache-2.0
// Blending: the alpha of a splat at a pixel, the splats of each tile, and a pixel's colour from them.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <numeric>
#include <span>
#include <vector>

#include "reference/projection.h"
#include "reference/values.h"
#include "shared/constants.h"

namespace ewa::reference {

/// The permutation that sorts: keys[result[0]] <= keys[result[1]] <= ..., with equal keys in their old order.
template <class Key>
std::vector<uint32_t> stable_order(std::span<const Key> keys) {
    std::vector<uint32_t> order(keys.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](uint32_t i, uint32_t j) { return keys[i] < keys[j]; });
    return order;
}

/// The indices of the visible splats, nearest first, ties by index. The key is the view depth in float32, as
/// on the device. So depths that differ by less than a float32 step are ties on both.
inline std::vector<uint32_t> depth_order(std::span<const Projected> projected) {
    std::vector<uint32_t> visible;
    std::vector<float> keys;
    for (size_t i = 0; i < projected.size(); ++i) {
        if (!projected[i].visible) continue;
        visible.push_back(uint32_t(i));
        keys.push_back(float(projected[i].z));
    }
    std::vector<uint32_t> order;
    for (uint32_t rank : stable_order<float>(keys)) order.push_back(visible[rank]);
    return order;
}

/// The exclusive prefix sum: out[i] = in[0] + ... + in[i - 1]. One more element at the end is the total.
inline std::vector<uint64_t> exclusive_scan(std::span<const uint32_t> counts) {
    std::vector<uint64_t> sums(counts.size() + 1, 0);
    for (size_t i = 0; i < counts.size(); ++i) sums[i + 1] = sums[i] + counts[i];
    return sums;
}

// The alpha of a splat at a pixel:
//   d = pixel centre - mean2d
//   u = (c d.x - b d.y) / sqrt(c det),  v = d.y / sqrt(c),  power = -(u^2 + v^2) / 2
//   raw alpha = opacity exp(power),  alpha = min(ALPHA_MAX, raw), 0 below ALPHA_MIN
//   with Footprint::density: raw depth = opacity exp(power), raw alpha = 1 - exp(-raw depth)
//
// (u, v) = L d, where L is the Cholesky factor of the inverse covariance L^T L. So the power equals the
// quadratic form of Kerbl et al. 2023, eq. 4, but as a sum of squares it cannot cancel.

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
/// density: raw is a depth.
Alpha alpha_of(double raw, const Smoothing& smoothing, bool density = false);

/// L = [ux uy; 0 vy].
struct Whitener {
    double ux = 0, uy = 0, vy = 0;
};
Whitener whitener(const Projected& splat);

struct Sample {
    double u = 0, v = 0;
    double raw = 0;  // raw alpha, or raw depth
};
inline glm::dvec2 pixel_centre(int x, int y) {
    return {x + 0.5, y + 0.5};
}
Sample sample(const Projected& splat, const Whitener& whitener, const glm::dvec2& pixel);

// Tiles list a splat if at least one of their pixel centres has a raw alpha of ALPHA_MIN or more. A shorter
// list would change the image, and a longer one would only cost time. The tiles are found by testing the
// pixels in the footprint's box: |d.x| <= r sqrt(a), |d.y| <= r sqrt(c), r = sqrt(2 ln(opacity / ALPHA_MIN)).

struct TileGrid {
    int image_width = 0, image_height = 0;  // px
    int tile_width = 16, tile_height = 16;  // px; the last column and row may exceed the image

    int columns() const { return (image_width + tile_width - 1) / tile_width; }
    int rows() const { return (image_height + tile_height - 1) / tile_height; }
    uint32_t count() const { return uint32_t(columns() * rows()); }
    uint32_t tile_of(int x, int y) const { return uint32_t((y / tile_height) * columns() + x / tile_width); }
};

/// The tiles of a splat in ascending order, row by row. Empty if the splat is invisible or outside the image.
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

/// Lists the (splat, tile) instances. order: the result of depth_order().
Instances make_instances(std::span<const Projected> projected, std::span<const uint32_t> order,
                         const TileGrid& grid, const Smoothing& smoothing = {});

// Front-to-back compositing of each pixel over its tile's list (Kerbl et al. 2023, eq. 3):
//   colour = sum_i c_i alpha_i T_i + T background,  T_i = prod_{j < i} (1 - alpha_j)
//   depth  = sum_i z_i alpha_i T_i
// It stops before the splat that would lower T to TRANSMITTANCE_STOP or below. Two opaque splats leave (1 -
// ALPHA_MAX)^2, which equals TRANSMITTANCE_STOP, so the second is skipped: 0.01 of its colour. Float32 has
// this result, as T * (1 - alpha). In float64, the product rounds to slightly above, hence kStopMargin.
#pragma once

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
        c.alpha = alpha_of(c.sample.raw, smoothing, projected[splat].density);
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
// With w = (u, v)^T = L d, the power -w.w/2 has
//   dpower/dmean2d = L^T w,  dpower/dSigma = L^T w w^T L / 2,  dpower/dopacity = 1 / opacity
// So a splat's gradient needs only the moments of g over its pixels, which add up over tiles:
//   dL/dmean2d = L^T (Su, Sv),  dL/dSigma = L^T [Suu Suv; Suv Svv] L / 2,  dL/dopacity = S0 / opacity

/// Sums over the pixels of one (splat, tile) instance.
struct Moments {
    double s0 = 0, su = 0, sv = 0, suu = 0, suv = 0, svv = 0;  // of g times 1, u, v, uu, uv, vv
    glm::dvec3 color{0};                                       // dL/dcolour
    glm::dvec2 absolute{0};                                    // sum of |dL/dmean2d|, by component
    double z = 0;                                              // dL/dz
    Moments& operator+=(const Moments& other);
};

ScreenGradient screen_gradient(const Projected& splat, const Moments& moments);

struct BlendGradients {
    std::vector<Moments> instances;      // per entry of instances.sorted
    std::vector<ScreenGradient> splats;  // per splat; its tiles are added in ascending order
};

/// `blended` is blend()'s result for the same arguments, `image_gradient` is dL/d(RGB) of each pixel, and
/// `transmittance_gradient` is dL/dT. T is behind all splats, as the background is: S has T more, times dL/dT in place of
/// dL/dC. Without entries it is 0. `depth_gradient` is dL/d(depth_sum), and depths are one more channel of the colour, without
/// a background.
BlendGradients blend_backward(std::span<const Projected> projected, const Instances& instances,
                              const Blended& blended, const Raster& image_gradient,
                              const Smoothing& smoothing = {}, const Raster& transmittance_gradient = {},
                              const Raster& depth_gradient = {});

/// The largest weight alpha T that each splat has at a pixel; 0 for one that no pixel shows (Niemeyer et al. 2024, RadSplat).
std::vector<double> largest_weights(std::span<const Projected> projected, const Instances& instances,
                                    const Smoothing& smoothing = {});

/// Renders splats as solids. A pixel shows the nearest splat, by its mean's depth, with an opacity of at
/// least ELLIPSOID_OPACITY whose ellipse contains the pixel. The ellipse has ELLIPSOID_REACH standard
/// deviations, including the low-pass. With the distance d in standard deviations, the RGB colour is
/// multiplied by ELLIPSOID_RIM + (1 - ELLIPSOID_RIM) sqrt(1 - (d / reach)^2), a sphere lit from the eye.
Raster ellipsoids(std::span<const Projected> projected, const Instances& instances,
                  const std::array<float, 3>& background);

}  // namespace ewa::reference
