// SPDX-License-Identifier: Apache-2.0
#include "reference/blend.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace ewa::reference {

using namespace shared;

double alpha_floor(const Smoothing& smoothing) {
    return smoothing.cut == AlphaCut::none ? 1e-18 : ALPHA_MIN;
}

Alpha alpha_of(double raw, const Smoothing& smoothing, bool density) {
    const double opacity = density ? -std::expm1(-raw) : raw;
    Alpha alpha;
    if (!(opacity >= alpha_floor(smoothing))) return alpha;
    alpha.kept = true;
    alpha.value = std::min(ALPHA_MAX, opacity);
    alpha.slope = opacity > ALPHA_MAX ? 0 : 1;
    if (smoothing.cut == AlphaCut::ramp) {
        const double t = std::clamp((opacity - ALPHA_MIN) / ALPHA_MIN, 0.0, 1.0);
        const double step = t * t * (3 - 2 * t);
        const double step_slope = 6 * t * (1 - t) / ALPHA_MIN;
        alpha.slope = alpha.slope * step + alpha.value * step_slope;
        alpha.value *= step;
    }
    if (density) alpha.slope *= std::exp(-raw);
    return alpha;
}

Whitener whitener(const Projected& splat) {
    const double root = std::sqrt(splat.c) * std::sqrt(splat.det);
    return {splat.c / root, -splat.b / root, 1 / std::sqrt(splat.c)};
}

Sample sample(const Projected& splat, const Whitener& w, const glm::dvec2& pixel) {
    glm::dvec2 d = pixel - splat.mean2d;
    if (splat.around > 0) d.x -= splat.around * std::round(d.x / splat.around);
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

/// The pixels of [0, size) whose centres are within reach of the middle, and one more against rounding.
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
    const double floor = raw_of(splat, alpha_floor(smoothing));
    if (!splat.visible || !(splat.opacity >= floor)) return tiles;
    const double r = std::sqrt(2 * std::log(splat.opacity / floor));
    Span xs = pixels_within(splat.mean2d.x, r * std::sqrt(splat.a), grid.image_width);
    if (splat.around > 0) xs = {0, grid.image_width};
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

std::vector<Whitener> whiteners_of(std::span<const Projected> projected) {
    std::vector<Whitener> whiteners(projected.size());
    for (size_t i = 0; i < projected.size(); ++i)
        if (projected[i].visible) whiteners[i] = whitener(projected[i]);
    return whiteners;
}

Blended blend(std::span<const Projected> projected, const Instances& instances,
              const std::array<float, 3>& background, const Smoothing& smoothing) {
    const int width = instances.grid.image_width, height = instances.grid.image_height;
    const Raster plane(width, height, 1);
    const std::vector<uint32_t> counts(plane.values.size());
    Blended out{Raster(width, height, 3), plane, plane, plane, counts, counts};
    const std::vector<Whitener> whiteners = whiteners_of(projected);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            double transmittance = 1, depth = 0;
            glm::dvec3 color(0);
            uint32_t count = 0;
            const uint32_t evaluated =
                walk_pixel(projected, whiteners, instances, x, y, smoothing, [&](const Contribution& c) {
                    const double weight = c.alpha.value * c.transmittance;
                    color += weight * projected[c.splat].color;
                    depth += weight * projected[c.splat].z;
                    transmittance = c.transmittance * (1 - c.alpha.value);
                    ++count;
                });
            for (int k = 0; k < 3; ++k) out.color.at(x, y)[k] = color[k] + transmittance * background[k];
            *out.transmittance.at(x, y) = transmittance;
            *out.depth_sum.at(x, y) = depth;
            *out.depth.at(x, y) = transmittance < 1 ? depth / (1 - transmittance) : 0;
            out.evaluated[size_t(y) * width + x] = evaluated;
            out.blended[size_t(y) * width + x] = count;
        }
    }
    return out;
}

Moments& Moments::operator+=(const Moments& other) {
    s0 += other.s0;
    su += other.su;
    sv += other.sv;
    suu += other.suu;
    suv += other.suv;
    svv += other.svv;
    color += other.color;
    absolute += other.absolute;
    z += other.z;
    return *this;
}

ScreenGradient screen_gradient(const Projected& splat, const Moments& m) {
    const auto [ux, uy, vy] = whitener(splat);  // L = [ux uy; 0 vy]
    ScreenGradient out;
    out.mean2d = {ux * m.su, uy * m.su + vy * m.sv};
    // L^T [suu suv; suv svv] L / 2, entry by entry; b takes both off-diagonal entries.
    out.a = 0.5 * ux * ux * m.suu;
    out.b = ux * (uy * m.suu + vy * m.suv);
    out.c = 0.5 * (uy * uy * m.suu + 2 * uy * vy * m.suv + vy * vy * m.svv);
    out.opacity = m.s0 / splat.opacity;
    out.color = m.color;
    out.absolute = m.absolute;
    out.z = m.z;
    return out;
}

BlendGradients blend_backward(std::span<const Projected> projected, const Instances& instances,
                              const Blended& blended, const Raster& image_gradient,
                              const Smoothing& smoothing, const Raster& transmittance_gradient,
                              const Raster& depth_gradient) {
    const int width = instances.grid.image_width, height = instances.grid.image_height;
    assert(image_gradient.width == width && image_gradient.height == height && image_gradient.channels == 3);
    BlendGradients out;
    out.instances.resize(instances.sorted.size());
    const std::vector<Whitener> whiteners = whiteners_of(projected);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const double* total = blended.color.at(x, y);
            const double* up = image_gradient.at(x, y);
            const glm::dvec3 pixel_gradient(up[0], up[1], up[2]);
            glm::dvec3 behind(total[0], total[1], total[2]);
            const double by_left = transmittance_gradient.values.empty()
                                       ? 0
                                       : *transmittance_gradient.at(x, y) * *blended.transmittance.at(x, y);
            const double by_depth = depth_gradient.values.empty() ? 0 : *depth_gradient.at(x, y);
            double deeper = *blended.depth_sum.at(x, y);
            walk_pixel(projected, whiteners, instances, x, y, smoothing, [&](const Contribution& c) {
                const double weight = c.alpha.value * c.transmittance, z = projected[c.splat].z;
                const glm::dvec3& color = projected[c.splat].color;
                behind -= weight * color;
                deeper -= weight * z;
                const double by_alpha =
                    glm::dot(pixel_gradient, c.transmittance * color - behind / (1 - c.alpha.value)) +
                    by_depth * (c.transmittance * z - deeper / (1 - c.alpha.value)) -
                    by_left / (1 - c.alpha.value);
                const double g = by_alpha * c.alpha.slope * c.sample.raw;
                const double u = c.sample.u, v = c.sample.v;
                const auto [ux, uy, vy] = whiteners[c.splat];
                const glm::dvec2 by_mean = g * glm::dvec2(ux * u, uy * u + vy * v);
                out.instances[c.instance] += {g,
                                              g * u,
                                              g * v,
                                              g * u * u,
                                              g * u * v,
                                              g * v * v,
                                              weight * pixel_gradient,
                                              glm::abs(by_mean),
                                              weight * by_depth};
            });
        }
    }
    std::vector<Moments> sums(projected.size());
    for (size_t k = 0; k < instances.sorted.size(); ++k) sums[instances.sorted[k].splat] += out.instances[k];
    out.splats.resize(projected.size());
    for (size_t i = 0; i < projected.size(); ++i)
        if (projected[i].visible) out.splats[i] = screen_gradient(projected[i], sums[i]);
    return out;
}

std::vector<double> largest_weights(std::span<const Projected> projected, const Instances& instances,
                                    const Smoothing& smoothing) {
    std::vector<double> largest(projected.size());
    const std::vector<Whitener> whiteners = whiteners_of(projected);
    for (int y = 0; y < instances.grid.image_height; ++y)
        for (int x = 0; x < instances.grid.image_width; ++x)
            walk_pixel(projected, whiteners, instances, x, y, smoothing, [&](const Contribution& c) {
                largest[c.splat] = std::max(largest[c.splat], c.alpha.value * c.transmittance);
            });
    return largest;
}

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
                const double height = 1 - (s.u * s.u + s.v * s.v) / (ELLIPSOID_REACH * ELLIPSOID_REACH);
                if (height < 0 || projected[splat].opacity < raw_of(projected[splat], ELLIPSOID_OPACITY))
                    continue;
                const double shade = ELLIPSOID_RIM + (1 - ELLIPSOID_RIM) * std::sqrt(height);
                for (int c = 0; c < 3; ++c) out.at(x, y)[c] = shade * projected[splat].color[c];
                break;
            }
        }
    return out;
}

}  // namespace ewa::reference
