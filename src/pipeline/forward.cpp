// SPDX-License-Identifier: Apache-2.0
#include "pipeline/forward.h"

#include "pipeline/sorting.h"

namespace ewa::pipeline {

shared::BlendPush blend_push(const Kernels& kernels, const Frame& frame, const CameraUse& camera,
                             const std::array<float, 3>& background) {
    const Sizes& s = frame.sizes;
    const auto steps = passes::tile_steps(kernels.shape(), s.tiles);
    return {{background[0], background[1], background[2]},
            {camera.width, camera.height},
            s.stride,
            s.plane_floats,
            {s.tiles_x, s.tiles_y},
            {steps[0], steps[1]},
            frame.instance_capacity};
}

namespace {

uint32_t blend_mode(const Plan& plan) {
    if (plan.ellipsoids) return shared::BLEND_ELLIPSOIDS;
    if (plan.count) return shared::BLEND_COUNT;
    return plan.depth ? shared::BLEND_DEPTH : shared::BLEND_COLOR;
}

}  // namespace

Sorted record_forward(gpu::Recording& recording, Kernels& kernels, const Plan& plan, const Model& model,
                      const Frame& frame, const CameraUse& camera, const std::array<float, 3>& background) {
    const passes::Shape& shape = kernels.shape();
    const Sizes& s = frame.sizes;
    recording.fill(frame.counts, 0, 0, sizeof(shared::Counts));

    kernels.get<passes::Project>(uint32_t(plan.sh_degree), uint32_t(plan.kernel), uint32_t(plan.inspected))
        .record(recording, shape,
                {model.params, *camera.buffer, camera.offset, frame.records, frame.depth_keys[0],
                 frame.tile_counts, frame.counts},
                {model.splats, model.planes(), plan.log_scale_shift});

    const uint32_t order_index = record_sort(recording, kernels,
                                             {{&frame.depth_keys[0], &frame.depth_keys[1]},
                                              {&frame.order[0], &frame.order[1]},
                                              {},
                                              true,
                                              frame.counters,
                                              frame.counter_prefix,
                                              frame.digit_totals,
                                              frame.counts},
                                             s.depth_sort, model.splats, model.splats, false, "depth order");
    const gpu::Buffer& order = frame.order[order_index];

    record_scan(recording, kernels,
                {frame.tile_counts, &order, frame.prefix, frame.scan_totals, frame.counts}, model.splats,
                s.scan_block, Total::instances, "instance offsets");
    kernels.get<passes::EmitInstances>(plan.gradients)
        .record(recording, shape,
                {frame.records, order, frame.tile_counts, frame.prefix, frame.scan_totals, frame.counts,
                 frame.instance_keys[0], frame.instance_splats[0], frame.first_instances},
                {model.splats,
                 frame.instance_capacity,
                 s.scan_block,
                 s.strip_rows,
                 {camera.width, camera.height},
                 {s.tiles_x, s.tiles_y}});

    // With gradients a splat must find its instances again: their slots stand in sorted order.
    const gpu::Buffer* places[2] = {plan.gradients ? &frame.instance_places[0] : nullptr,
                                    plan.gradients ? &frame.instance_places[1] : nullptr};
    const uint32_t sorted = record_sort(recording, kernels,
                                        {{&frame.instance_keys[0], &frame.instance_keys[1]},
                                         {&frame.instance_splats[0], &frame.instance_splats[1]},
                                         {places[0], places[1]},
                                         false,
                                         frame.counters,
                                         frame.counter_prefix,
                                         frame.digit_totals,
                                         frame.counts},
                                        s.tile_sort, 0, frame.instance_capacity, true, "tile order");
    const gpu::Buffer& splats = frame.instance_splats[sorted];
    kernels.get<passes::TileStarts>().record(recording, shape,
                                             {frame.instance_keys[sorted], frame.counts, frame.tile_starts},
                                             {s.tiles, frame.instance_capacity});

    kernels.get<passes::Blend>(blend_mode(plan))
        .record(recording, shape, {frame.records, splats, frame.tile_starts, frame.planes},
                blend_push(kernels, frame, camera, background));
    return {&splats, places[sorted]};
}

}  // namespace ewa::pipeline
