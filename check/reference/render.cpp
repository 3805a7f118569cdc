// SPDX-License-Identifier: Apache-2.0
#include "reference/render.h"

#include "reference/blend.h"
#include "reference/points.h"
#include "reference/projection.h"
#include "reference/rays.h"
#include "reference/sky.h"

namespace ewa::reference {

Rendered render(const Values& values, const Camera& camera, const RenderOptions& options,
                const ReferenceOptions& reference) {
    if (options.points) return render_points(values, camera, options);
    Rendered out;
    if (options.integrator != Integrator::splat) {
        const Rays rays(values, camera, options, reference.smoothing);
        out.projected = rays.projected();
        for (const Projected& each : out.projected) out.skipped_nonfinite += each.skipped_nonfinite;
        out.blended = rays.blended();
        return out;
    }
    for (size_t i = 0; i < values.size(); ++i) {
        out.projected.push_back(project(values, i, camera, options));
        if (out.projected.back().skipped_nonfinite) ++out.skipped_nonfinite;
    }
    out.order = depth_order(out.projected);
    const TileGrid grid{camera.width, camera.height, reference.tile_width, reference.tile_height};
    out.instances = make_instances(out.projected, out.order, grid, reference.smoothing);
    const auto background = options.sky ? std::array<float, 3>{} : options.background;
    out.blended = blend(out.projected, out.instances, background, reference.smoothing);
    if (options.sky)
        out.blended.color = over_sky(out.blended.color, out.blended.transmittance, camera, *options.sky);
    return out;
}

namespace {

Raster composited(const Image& rgba, const std::array<float, 3>& background) {
    Raster out(rgba.width, rgba.height, 3);
    for (size_t i = 0; i < out.values.size(); ++i) {
        const double alpha = double(rgba.pixels[4 * (i / 3) + 3]);
        out.values[i] =
            alpha * double(rgba.pixels[4 * (i / 3) + i % 3]) + (1 - alpha) * double(background[i % 3]);
    }
    return out;
}

}  // namespace

ReferenceGradient loss_gradient(const Values& values, const Camera& camera, const Image& target,
                                const RenderOptions& options, const ReferenceOptions& reference) {
    if (options.points) return points_loss_gradient(values, camera, target, options, reference.loss);
    ReferenceGradient out;
    out.rendered = render(values, camera, options, reference);
    const bool cut = reference.loss.alpha > 0;
    const Loss loss =
        image_loss(out.rendered.blended.color,
                   cut ? composited(target, options.background) : to_double(target), reference.loss);
    out.loss = loss.loss;
    out.l1 = loss.l1;
    out.l2 = loss.l2;
    out.ssim = loss.ssim;
    out.image_gradient = loss.gradient;
    if (options.integrator != Integrator::splat) {
        out.gradient = Rays(values, camera, options, reference.smoothing).gradient(loss.gradient);
        for (const Projected& each : out.rendered.projected) out.in_view.push_back(each.visible);
        return out;
    }
    Raster by_left;
    if (cut) {
        Raster alpha(target.width, target.height, 1);
        for (size_t i = 0; i < alpha.values.size(); ++i) alpha.values[i] = target.pixels[4 * i + 3];
        const AlphaLoss of_alpha = alpha_loss(out.rendered.blended.transmittance, alpha);
        out.alpha = of_alpha.difference;
        out.loss += reference.loss.alpha * of_alpha.difference;
        by_left = of_alpha.gradient;
        for (double& value : by_left.values) value *= reference.loss.alpha;
    }
    Raster by_depth;
    if (reference.loss.depth > 0) {
        const Blended& blended = out.rendered.blended;
        const DepthLoss of_depth = depth_loss(blended.depth_sum, blended.transmittance, reference.depths);
        out.depth = of_depth.difference;
        out.loss += reference.loss.depth * of_depth.difference;
        by_depth = of_depth.by_sum;
        for (double& value : by_depth.values) value *= reference.loss.depth;
        if (!cut) by_left = Raster(target.width, target.height, 1);
        for (size_t i = 0; i < by_left.values.size(); ++i)
            by_left.values[i] += reference.loss.depth * of_depth.by_left.values[i];
    }
    out.blend = blend_backward(out.rendered.projected, out.rendered.instances, out.rendered.blended,
                               loss.gradient, reference.smoothing, by_left, by_depth);
    out.gradient = zeros_like(values);
    for (size_t i = 0; i < values.size(); ++i)
        write_splat(
            out.gradient, i,
            project_backward(read_splat(values, i), camera, options, out.blend.splats[i], &out.camera));
    out.in_view.assign(values.size(), 0);
    for (const Instance& instance : out.rendered.instances.sorted) out.in_view[instance.splat] = 1;
    return out;
}

}  // namespace ewa::reference
