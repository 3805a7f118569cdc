// SPDX-License-Identifier: Apache-2.0
#include "reference/blend_backward.h"

#include <cassert>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace ewa::reference {

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

}  // namespace ewa::reference
