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

ReferenceGradient loss_gradient(const Values& values, const Camera& camera, const Image& target,
                                const RenderOptions& options, const ReferenceOptions& reference) {
    if (options.points) return points_loss_gradient(values, camera, target, options, reference.loss);
    ReferenceGradient out;
    out.rendered = render(values, camera, options, reference);
    const Loss loss = image_loss(out.rendered.blended.color, to_double(target), reference.loss);
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
    out.blend = blend_backward(out.rendered.projected, out.rendered.instances, out.rendered.blended,
                               loss.gradient, reference.smoothing);
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
