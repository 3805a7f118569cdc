// SPDX-License-Identifier: Apache-2.0
#include "reference/surface.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "shared/constants.h"

namespace ewa::reference {
namespace {

bool orders_by_distance(const Camera& camera) {
    const Lens lens = camera.distortion.lens;
    return lens == Lens::fisheye || lens == Lens::equirectangular;
}

glm::dvec2 depth_slope(const ProjectionSteps& s, const Projected& p, const Camera& camera) {
    const glm::dvec3 along =
        (orders_by_distance(camera) ? glm::normalize(s.view) : glm::dvec3(0, 0, 1)) * camera.rotation;
    const glm::dvec3 depths = (along * s.rotation) * s.scale;
    const double x = glm::dot(s.m.x, depths), y = glm::dot(s.m.y, depths);
    return glm::dvec2(p.c * x - p.b * y, p.a * y - p.b * x) / p.det;
}

glm::dvec3 normal_of(const ProjectionSteps& s) {
    const glm::dvec3 v = s.direction * s.rotation;  // in the splat's axes
    const double least = std::min({s.scale.x, s.scale.y, s.scale.z});
    const glm::dvec3 ratio = least / s.scale;
    return -glm::normalize(s.rotation * (v * ratio * ratio));
}

/// Calls visit(x, y, contributions of the pixel).
template <class Visit>
void walk_image(const Rendered& rendered, const Smoothing& smoothing, Visit visit) {
    const std::vector<Whitener> whiteners = whiteners_of(rendered.projected);
    const TileGrid& grid = rendered.instances.grid;
    for (int y = 0; y < grid.image_height; ++y)
        for (int x = 0; x < grid.image_width; ++x) {
            std::vector<Contribution> met;
            walk_pixel(rendered.projected, whiteners, rendered.instances, x, y, smoothing,
                       [&](const Contribution& c) { met.push_back(c); });
            visit(x, y, met);
        }
}

}  // namespace

std::vector<Surface> surfaces(const Values& values, const Camera& camera, const RenderOptions& options) {
    std::vector<Surface> out(values.size());
    for (size_t i = 0; i < values.size(); ++i) {
        ProjectionSteps steps;
        const Projected p = project(read_splat(values, i), camera, options, &steps);
        if (p.visible) out[i] = {normal_of(steps), depth_slope(steps, p, camera)};
    }
    return out;
}

Raster median_depth(const Rendered& rendered, std::span<const Surface> surfaces, const Smoothing& smoothing) {
    Raster out(rendered.instances.grid.image_width, rendered.instances.grid.image_height, 1);
    walk_image(rendered, smoothing, [&](int x, int y, const std::vector<Contribution>& met) {
        for (const Contribution& c : met) {
            if (c.transmittance * (1 - c.alpha.value) > shared::MEDIAN_TRANSMITTANCE) continue;
            const Projected& p = rendered.projected[c.splat];
            glm::dvec2 d = pixel_centre(x, y) - p.mean2d;
            if (p.around > 0) d.x -= p.around * std::round(d.x / p.around);
            *out.at(x, y) = std::max(p.z + glm::dot(surfaces[c.splat].slope, d), double(shared::NEAR_PLANE));
            return;
        }
    });
    return out;
}

Raster normals(const Rendered& rendered, std::span<const Surface> surfaces, const Smoothing& smoothing) {
    Raster out(rendered.instances.grid.image_width, rendered.instances.grid.image_height, 3);
    walk_image(rendered, smoothing, [&](int x, int y, const std::vector<Contribution>& met) {
        glm::dvec3 sum(0);
        for (const Contribution& c : met) sum += c.alpha.value * c.transmittance * surfaces[c.splat].normal;
        const double length = glm::length(sum);
        if (length > 0) sum /= length;
        for (int k = 0; k < 3; ++k) out.at(x, y)[k] = sum[k];
    });
    return out;
}

}  // namespace ewa::reference
