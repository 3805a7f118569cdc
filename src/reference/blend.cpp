// SPDX-License-Identifier: Apache-2.0
#include "reference/blend.h"

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

}  // namespace ewa::reference
