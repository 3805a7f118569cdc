// SPDX-License-Identifier: Apache-2.0
#include "reference/points.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

#include "shared/constants.h"

namespace ewa::reference {
namespace {

using namespace shared;

struct Sphere {
    Projected projected;
    glm::dvec2 variance{0};  // px^2, without the low-pass
    glm::dvec2 radius{1};    // px
};

/// A splat whose centre and colour are those of the sphere. Its footprint is a point.
Splat centre_of(const Splat& splat) {
    constexpr double kOpaque = 10;    // logit
    constexpr double kPoint = -1000;  // logarithm of a scale
    Splat centre = splat;
    if (!std::isfinite(splat.opacity_logit)) return centre;
    centre.opacity_logit = kOpaque;
    for (int k = 0; k < 3; ++k)
        if (std::isfinite(splat.log_scale[k])) centre.log_scale[k] = kPoint;
    return centre;
}

/// The options under which project() and project_backward() have the centre and the colour alone.
RenderOptions centre_options(const RenderOptions& options) {
    RenderOptions centre = options;
    centre.kernel = Footprint::peak;
    return centre;
}

Sphere project_sphere(const Splat& splat, const Camera& camera, const RenderOptions& options) {
    Sphere sphere;
    Projected& p = sphere.projected;
    p = project(centre_of(splat), camera, centre_options(options));
    if (!p.visible) return sphere;
    const double scale = std::exp((splat.log_scale.x + splat.log_scale.y + splat.log_scale.z) / 3);
    const glm::dvec2 deviation(camera.fx * scale / p.z, camera.fy * scale / p.z);
    if (!(deviation.x + deviation.y <= FOOTPRINT_MAX)) {
        p.visible = false;
        p.skipped_nonfinite = true;
        return sphere;
    }
    sphere.variance = deviation * deviation;
    sphere.radius = ELLIPSOID_REACH * glm::sqrt(sphere.variance + LOW_PASS);
    p.a = sphere.variance.x + LOW_PASS;
    p.c = sphere.variance.y + LOW_PASS;
    p.det = p.a * p.c;
    p.opacity = 1;
    return sphere;
}

std::vector<Sphere> project_all(const Values& values, const Camera& camera, const RenderOptions& options) {
    std::vector<Sphere> spheres;
    for (size_t i = 0; i < values.size(); ++i)
        spheres.push_back(project_sphere(read_splat(values, i), camera, options));
    return spheres;
}

/// A sphere at a pixel that draws it.
struct SphereHit {
    uint32_t splat = 0;
    glm::dvec2 w{0};  // u, v
    double alpha = 0;
    bool clamped = false;
    double transmittance = 1;  // in front of the sphere
};

struct PixelBounds {
    int first = 0, end = 0;
};

/// The pixels of [0, size) whose centres are within the radius, and one more against rounding.
PixelBounds pixels_of(double middle, double radius, int size) {
    const double first = std::floor(middle - radius - 0.5), end = std::ceil(middle + radius - 0.5) + 1;
    return {int(std::clamp(first, 0.0, double(size))), int(std::clamp(end, 0.0, double(size)))};
}

/// Calls visit(x, y, SphereHit) for each sphere of each pixel, front to back at each pixel.
template <class Visit>
void walk(const std::vector<Sphere>& spheres, const std::vector<uint32_t>& order, const Camera& camera,
          int nearest, Visit&& visit) {
    const size_t pixels = size_t(camera.width) * camera.height;
    std::vector<double> transmittance(pixels, 1.0);
    std::vector<int> left(pixels, nearest);
    for (const uint32_t i : order) {
        const Sphere& sphere = spheres[i];
        const glm::dvec2 mean = sphere.projected.mean2d;
        const PixelBounds xs = pixels_of(mean.x, sphere.radius.x, camera.width);
        const PixelBounds ys = pixels_of(mean.y, sphere.radius.y, camera.height);
        for (int y = ys.first; y < ys.end; ++y)
            for (int x = xs.first; x < xs.end; ++x) {
                const size_t at = size_t(y) * camera.width + x;
                const glm::dvec2 w = (pixel_centre(x, y) - mean) / sphere.radius;
                const double raw = 1 - glm::dot(w, w);
                if (!(raw > 0) || left[at] == 0) continue;
                --left[at];
                const SphereHit hit{i, w, std::min(ALPHA_MAX, raw), raw > ALPHA_MAX, transmittance[at]};
                visit(x, y, hit);
                transmittance[at] *= 1 - hit.alpha;
                if (stops(transmittance[at])) left[at] = 0;
            }
    }
}

void blend_spheres(const std::vector<Sphere>& spheres, const Camera& camera, const RenderOptions& options,
                   Rendered& out) {
    const Raster plane(camera.width, camera.height, 1);
    const std::vector<uint32_t> counts(plane.values.size());
    Blended& b = out.blended;
    b = {Raster(camera.width, camera.height, 3), plane, plane, plane, counts, counts};
    std::fill(b.transmittance.values.begin(), b.transmittance.values.end(), 1.0);
    walk(spheres, out.order, camera, options.nearest, [&](int x, int y, const SphereHit& hit) {
        const Projected& p = spheres[hit.splat].projected;
        const double weight = hit.alpha * hit.transmittance;
        for (int k = 0; k < 3; ++k) b.color.at(x, y)[k] += weight * p.color[k];
        *b.depth_sum.at(x, y) += weight * p.z;
        *b.transmittance.at(x, y) = hit.transmittance * (1 - hit.alpha);
        ++b.blended[size_t(y) * camera.width + x];
    });
    for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
            const double left = *b.transmittance.at(x, y);
            for (int k = 0; k < 3; ++k) b.color.at(x, y)[k] += left * options.background[size_t(k)];
            if (left < 1) *b.depth.at(x, y) = *b.depth_sum.at(x, y) / (1 - left);
        }
    b.evaluated = b.blended;
}

/// Sums over the pixels of a sphere.
struct SphereGradient {
    ScreenGradient screen;
    glm::dvec2 log_radius{0};  // dL/d(ln radius) of both axes
};

std::vector<SphereGradient> blend_spheres_backward(const std::vector<Sphere>& spheres,
                                                   const Rendered& rendered, const Camera& camera,
                                                   int nearest, const Raster& image_gradient) {
    std::vector<SphereGradient> out(spheres.size());
    Raster behind = rendered.blended.color;
    walk(spheres, rendered.order, camera, nearest, [&](int x, int y, const SphereHit& hit) {
        const Sphere& sphere = spheres[hit.splat];
        const double* up = image_gradient.at(x, y);
        const glm::dvec3 by_pixel(up[0], up[1], up[2]);
        const double weight = hit.alpha * hit.transmittance;
        double* rest = behind.at(x, y);
        for (int k = 0; k < 3; ++k) rest[k] -= weight * sphere.projected.color[k];
        SphereGradient& g = out[hit.splat];
        g.screen.color += weight * by_pixel;
        if (hit.clamped) return;
        const glm::dvec3 last(rest[0], rest[1], rest[2]);
        const double by_alpha =
            glm::dot(by_pixel, hit.transmittance * sphere.projected.color - last / (1 - hit.alpha));
        const glm::dvec2 by_mean = 2 * by_alpha * hit.w / sphere.radius;
        g.screen.mean2d += by_mean;
        g.screen.absolute += glm::abs(by_mean);
        g.log_radius += 2 * by_alpha * hit.w * hit.w;
    });
    return out;
}

Splat sphere_backward(const Splat& splat, const Sphere& sphere, const Camera& camera,
                      const RenderOptions& options, const SphereGradient& gradient) {
    Splat out;
    out.sh_degree = splat.sh_degree;
    if (!sphere.projected.visible) return out;
    out = project_backward(centre_of(splat), camera, centre_options(options), gradient.screen);
    out.quaternion = {};
    out.opacity_logit = 0;
    const glm::dvec2 share = sphere.variance / (sphere.variance + LOW_PASS);
    const double by_log_scale = glm::dot(share, gradient.log_radius);
    out.log_scale = glm::dvec3(by_log_scale / 3);
    const glm::dvec3 by_view(0, 0, -by_log_scale / sphere.projected.z);
    out.mean += glm::transpose(camera.rotation) * by_view;
    return out;
}

}  // namespace

Rendered render_points(const Values& values, const Camera& camera, const RenderOptions& options) {
    const std::vector<Sphere> spheres = project_all(values, camera, options);
    Rendered out;
    for (const Sphere& sphere : spheres) {
        out.projected.push_back(sphere.projected);
        if (sphere.projected.skipped_nonfinite) ++out.skipped_nonfinite;
    }
    out.order = depth_order(out.projected);
    out.instances.grid = {.image_width = camera.width, .image_height = camera.height};
    out.instances.first_of_tile.assign(size_t(out.instances.grid.count()) + 1, 0);
    blend_spheres(spheres, camera, options, out);
    return out;
}

ReferenceGradient points_loss_gradient(const Values& values, const Camera& camera, const Image& target,
                                       const RenderOptions& options, const LossWeights& weights) {
    ReferenceGradient out;
    out.rendered = render_points(values, camera, options);
    const Loss loss = image_loss(out.rendered.blended.color, to_double(target), weights);
    out.loss = loss.loss;
    out.l1 = loss.l1;
    out.l2 = loss.l2;
    out.ssim = loss.ssim;
    out.image_gradient = loss.gradient;
    const std::vector<Sphere> spheres = project_all(values, camera, options);
    const std::vector<SphereGradient> by_sphere =
        blend_spheres_backward(spheres, out.rendered, camera, options.nearest, loss.gradient);
    out.gradient = zeros_like(values);
    for (size_t i = 0; i < values.size(); ++i) {
        out.blend.splats.push_back(by_sphere[i].screen);
        write_splat(out.gradient, i,
                    sphere_backward(read_splat(values, i), spheres[i], camera, options, by_sphere[i]));
    }
    // A sphere covers at least one pixel centre wherever its own centre is in the image.
    out.in_view.assign(values.size(), 0);
    walk(spheres, out.rendered.order, camera, std::numeric_limits<int>::max(),
         [&](int, int, const SphereHit& hit) { out.in_view[hit.splat] = 1; });
    return out;
}

}  // namespace ewa::reference
