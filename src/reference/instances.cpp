// SPDX-License-Identifier: Apache-2.0
#include "reference/instances.h"

#include <algorithm>
#include <cmath>

#include "reference/sort.h"
#include "shared/constants.h"

namespace ewa::reference {

using namespace shared;

double alpha_floor(const Smoothing& smoothing) {
    return smoothing.cut == AlphaCut::none ? 1e-18 : ALPHA_MIN;
}

Alpha alpha_of(double raw, const Smoothing& smoothing) {
    Alpha alpha;
    if (!(raw >= alpha_floor(smoothing))) return alpha;
    alpha.kept = true;
    alpha.value = std::min(ALPHA_MAX, raw);
    alpha.slope = raw > ALPHA_MAX ? 0 : 1;
    if (smoothing.cut == AlphaCut::ramp) {
        const double t = std::clamp((raw - ALPHA_MIN) / ALPHA_MIN, 0.0, 1.0);
        const double step = t * t * (3 - 2 * t);
        const double step_slope = 6 * t * (1 - t) / ALPHA_MIN;
        alpha.slope = alpha.slope * step + alpha.value * step_slope;
        alpha.value *= step;
    }
    return alpha;
}

Whitener whitener(const Projected& splat) {
    const double root = std::sqrt(splat.c) * std::sqrt(splat.det);
    return {splat.c / root, -splat.b / root, 1 / std::sqrt(splat.c)};
}

Sample sample(const Projected& splat, const Whitener& w, const glm::dvec2& pixel) {
    const glm::dvec2 d = pixel - splat.mean2d;
    Sample s;
    s.u = w.ux * d.x + w.uy * d.y;
    s.v = w.vy * d.y;
    s.raw = splat.opacity * std::exp(-0.5 * (s.u * s.u + s.v * s.v));
    return s;
}

namespace {

struct Span {
    int first = 0, end = 0;
};

/// The pixels of [0, size) whose centres are within reach of the middle, with a margin of one pixel against
/// rounding.
Span pixels_within(double middle, double reach, int size) {
    const double first = std::floor(middle - reach - 0.5);
    const double end = std::ceil(middle + reach - 0.5) + 1;
    return {int(std::clamp(first, 0.0, double(size))), int(std::clamp(end, 0.0, double(size)))};
}

bool touches(const Projected& splat, const Whitener& w, Span xs, Span ys, double floor) {
    for (int y = ys.first; y < ys.end; ++y)
        for (int x = xs.first; x < xs.end; ++x)
            if (sample(splat, w, pixel_centre(x, y)).raw >= floor) return true;
    return false;
}

Span intersection(Span a, int first, int end) {
    return {std::max(a.first, first), std::min(a.end, end)};
}

}  // namespace

std::vector<uint32_t> covered_tiles(const Projected& splat, const TileGrid& grid,
                                    const Smoothing& smoothing) {
    std::vector<uint32_t> tiles;
    const double floor = alpha_floor(smoothing);
    if (!splat.visible || !(splat.opacity >= floor)) return tiles;
    const double r = std::sqrt(2 * std::log(splat.opacity / floor));
    const Span xs = pixels_within(splat.mean2d.x, r * std::sqrt(splat.a), grid.image_width);
    const Span ys = pixels_within(splat.mean2d.y, r * std::sqrt(splat.c), grid.image_height);
    if (xs.first >= xs.end || ys.first >= ys.end) return tiles;
    const Whitener w = whitener(splat);
    const int tw = grid.tile_width, th = grid.tile_height;
    for (int row = ys.first / th; row <= (ys.end - 1) / th; ++row)
        for (int column = xs.first / tw; column <= (xs.end - 1) / tw; ++column)
            if (touches(splat, w, intersection(xs, column * tw, (column + 1) * tw),
                        intersection(ys, row * th, (row + 1) * th), floor))
                tiles.push_back(uint32_t(row * grid.columns() + column));
    return tiles;
}

Instances make_instances(std::span<const Projected> projected, std::span<const uint32_t> order,
                         const TileGrid& grid, const Smoothing& smoothing) {
    Instances out;
    out.grid = grid;
    std::vector<uint32_t> counts, keys;
    std::vector<Instance> emitted;
    for (uint32_t splat : order) {
        const std::vector<uint32_t> tiles = covered_tiles(projected[splat], grid, smoothing);
        counts.push_back(uint32_t(tiles.size()));
        for (uint32_t tile : tiles) {
            emitted.push_back({tile, splat});
            keys.push_back(tile);
        }
    }
    out.first_of_rank = exclusive_scan(counts);
    for (uint32_t i : stable_order<uint32_t>(keys)) out.sorted.push_back(emitted[i]);

    std::vector<uint32_t> per_tile(grid.count(), 0);
    for (uint32_t tile : keys) ++per_tile[tile];
    out.first_of_tile = exclusive_scan(per_tile);
    return out;
}

}  // namespace ewa::reference
