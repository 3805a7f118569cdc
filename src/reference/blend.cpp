// SPDX-License-Identifier: Apache-2.0
#include "reference/blend.h"

#include <cassert>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace ewa::reference {

std::vector<Whitener> whiteners_of(std::span<const Projected> projected) {
    std::vector<Whitener> whiteners(projected.size());
    for (size_t i = 0; i < projected.size(); ++i)
        if (projected[i].visible) whiteners[i] = whitener(projected[i]);
    return whiteners;
}

Blended blend(std::span<const Projected> projected, const Instances& instances,
              const std::array<float, 3>& background, const Smoothing& smoothing) {
    const int width = instances.grid.image_width, height = instances.grid.image_height;
    Blended out{Raster(width, height, 3),
                Raster(width, height, 1),
                Raster(width, height, 1),
                Raster(width, height, 1),
                std::vector<uint32_t>(size_t(width) * height),
                std::vector<uint32_t>(size_t(width) * height)};
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
    return out;
}

BlendGradients blend_backward(std::span<const Projected> projected, const Instances& instances,
                              const Blended& blended, const Raster& picture_gradient,
                              const Smoothing& smoothing) {
    const int width = instances.grid.image_width, height = instances.grid.image_height;
    assert(picture_gradient.width == width && picture_gradient.height == height &&
           picture_gradient.channels == 3);
    BlendGradients out;
    out.instances.resize(instances.sorted.size());
    const std::vector<Whitener> whiteners = whiteners_of(projected);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const double* total = blended.color.at(x, y);
            const double* up = picture_gradient.at(x, y);
            const glm::dvec3 pixel_gradient(up[0], up[1], up[2]);
            glm::dvec3 behind(total[0], total[1], total[2]);
            walk_pixel(projected, whiteners, instances, x, y, smoothing, [&](const Contribution& c) {
                const double weight = c.alpha.value * c.transmittance;
                const glm::dvec3& color = projected[c.splat].color;
                behind -= weight * color;
                const double by_alpha =
                    glm::dot(pixel_gradient, c.transmittance * color - behind / (1 - c.alpha.value));
                const double g = by_alpha * c.alpha.slope * c.sample.raw;
                const double u = c.sample.u, v = c.sample.v;
                const auto [ux, uy, vy] = whiteners[c.splat];
                out.instances[c.instance] += {g,
                                              g * u,
                                              g * v,
                                              g * u * u,
                                              g * u * v,
                                              g * v * v,
                                              weight * pixel_gradient,
                                              glm::abs(g * glm::dvec2(ux * u, uy * u + vy * v))};
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
