// SPDX-License-Identifier: Apache-2.0
#include "pipeline/forward.h"

#include <algorithm>
#include <bit>

#include "passes/passes.h"
#include "pipeline/sorting.h"

namespace ewa::pipeline {
namespace {

/// In the order of Drawing.
constexpr uint32_t kBlendModes[] = {shared::BLEND_COLOR, shared::BLEND_DEPTH, shared::BLEND_COUNT,
                                    shared::BLEND_ELLIPSOIDS};

/// Projection: passes::Project or ProjectPoints.
template <class Projection>
void record_project_as(const FramePasses& on, const Model& model, const FrameInputs& inputs,
                       const passes::Constants& variant) {
    const auto& [recording, cache, plan, frame] = on;
    const CameraUse& camera = inputs.camera;
    cache.get<Projection>(variant).record(
        recording,
        {.params = model.params,
         .camera = {*camera.buffer, camera.offset, sizeof(shared::CameraBlock)},
         .records = frame.records,
         .depth_keys = frame.depth_keys[0],
         .tile_counts = frame.tile_counts,
         .counts = frame.counts},
        {.splats = model.splats, .planes = model.planes(), .log_scale_shift = plan.log_scale_shift});
}

void record_project(const FramePasses& on, const Model& model, const FrameInputs& inputs) {
    const Plan& plan = on.plan;
    passes::Constants variant{{shared::SPEC_SH_DEGREE, plan.evaluated_degree(inputs.sh_degree)},
                              {shared::SPEC_MODE, plan.debug ? shared::PROJECT_DEBUG : 0}};
    if (plan.points()) return record_project_as<passes::ProjectPoints>(on, model, inputs, variant);
    variant.push_back({shared::SPEC_KERNEL, uint32_t(plan.kernel)});
    record_project_as<passes::Project>(on, model, inputs, variant);
}

/// Blending: passes::Blend or BlendPoints.
template <class Blending>
void record_blend_as(const FramePasses& on, const FrameInputs& inputs, const passes::Constants& variant) {
    const auto& [recording, cache, plan, frame] = on;
    cache.get<Blending>(variant).record(recording,
                                        {.records = frame.records,
                                         .splats = frame.instance_splats[1],
                                         .tile_starts = frame.tile_starts,
                                         .planes = frame.planes},
                                        blend_push(cache.config(), frame, inputs.background));
}

void record_project_rays(const FramePasses& on, const Model& model, const FrameInputs& inputs) {
    const auto& [recording, cache, plan, frame] = on;
    cache
        .get<passes::ProjectRays>(
            {{shared::SPEC_SH_DEGREE, plan.evaluated_degree(inputs.sh_degree)},
             {shared::SPEC_KERNEL, uint32_t(plan.kernel)},
             {shared::SPEC_MODE, plan.integrator == Integrator::march ? shared::PROJECT_RAYS_DEEP : 0}})
        .record(recording,
                {.params = model.params,
                 .camera = camera_part(inputs),
                 .records = frame.records,
                 .depth_keys = frame.depth_keys[0],
                 .tile_counts = frame.tile_counts,
                 .counts = frame.counts,
                 .rays = frame.rays},
                {.splats = model.splats, .planes = model.planes(), .log_scale_shift = 0});
}

/// Integration along rays: passes::BlendRays or MarchRays.
template <class Integration>
void record_integrate_as(const FramePasses& on, const FrameInputs& inputs, uint32_t mode) {
    const auto& [recording, cache, plan, frame] = on;
    cache.get<Integration>({{shared::SPEC_KERNEL, uint32_t(plan.kernel)}, {shared::SPEC_MODE, mode}})
        .record(recording,
                {{.records = frame.records,
                  .splats = frame.instance_splats[1],
                  .tile_starts = frame.tile_starts,
                  .planes = frame.planes,
                  .rays = frame.rays,
                  .camera = camera_part(inputs),
                  .counts = frame.counts}},
                {.blend = blend_push(cache.config(), frame, inputs.background),
                 .samples = inputs.samples,
                 .strip = 0});
}

/// The buffer of splats in depth order.
const gpu::Buffer& record_depth_order(gpu::Recording& recording, passes::PassCache& cache, uint32_t splats,
                                      const FrameBuffers& frame) {
    const uint32_t result = record_sort(recording, cache,
                                        {.keys = {&frame.depth_keys[0], &frame.depth_keys[1]},
                                         .values = {&frame.order[0], &frame.order[1]},
                                         .indices = {},
                                         .own_indices = true,
                                         .counters = frame.counters,
                                         .counter_prefix = frame.counter_prefix,
                                         .digit_totals = frame.digit_totals,
                                         .counts = frame.counts},
                                        {.cut = frame.sizes.depth_sort,
                                         .items = splats,
                                         .capacity = splats,
                                         .keep_keys = false,
                                         .name = "depth order"});
    return frame.order[result];
}

void record_instances(gpu::Recording& recording, passes::PassCache& cache, bool gradients, uint32_t splats,
                      const FrameBuffers& frame, const gpu::Buffer& order) {
    const Sizes& s = frame.sizes;
    record_scan(recording, cache,
                {.source = frame.tile_counts,
                 .order = &order,
                 .prefix = frame.prefix,
                 .totals = frame.scan_totals,
                 .counts = frame.counts},
                {.items = splats,
                 .block = s.scan_block,
                 .total = shared::TOTAL_INSTANCES,
                 .name = "instance offsets",
                 .capacity = frame.instance_capacity});
    cache.get<passes::EmitInstances>({{shared::SPEC_MODE, gradients ? shared::EMIT_FIRST_INSTANCES : 0}})
        .record(recording,
                {.records = frame.records,
                 .order = order,
                 .tile_counts = frame.tile_counts,
                 .prefix = frame.prefix,
                 .totals = frame.scan_totals,
                 .counts = frame.counts,
                 .keys = frame.instance_keys[frame.tile_sort_start()],
                 .splats = frame.instance_splats[frame.tile_sort_start()],
                 .first_instances = frame.first_instances},
                {.splats = splats,
                 .capacity = frame.instance_capacity,
                 .scan_block = s.scan_block,
                 .strip_rows = s.strip_rows,
                 .size = {s.width, s.height},
                 .tiles = {s.tiles_x, s.tiles_y}});
}

/// The result is in the second buffers.
void record_tile_order(gpu::Recording& recording, passes::PassCache& cache, bool gradients,
                       const FrameBuffers& frame) {
    // With gradients a splat must find its instances again: their slots are in sorted order.
    const auto indices = [&](uint32_t i) { return gradients ? &frame.sorted_indices[i] : nullptr; };
    const uint32_t a = frame.tile_sort_start(), b = 1 - a;
    const Sizes& s = frame.sizes;
    record_sort(recording, cache,
                {.keys = {&frame.instance_keys[a], &frame.instance_keys[b]},
                 .values = {&frame.instance_splats[a], &frame.instance_splats[b]},
                 .indices = {indices(a), indices(b)},
                 .own_indices = false,
                 .counters = frame.counters,
                 .counter_prefix = frame.counter_prefix,
                 .digit_totals = frame.digit_totals,
                 .counts = frame.counts},
                {.cut = s.tile_sort,
                 .items = 0,
                 .capacity = frame.instance_capacity,
                 .keep_keys = s.tile_sort.passes > 1,
                 .name = "tile order"});
    // The one digit of a sort in one pass is the tile.
    if (s.tile_sort.passes == 1)
        recording.copy(frame.digit_totals, 0, frame.tile_starts, 0, s.tile_starts);
    else
        cache.get<passes::TileStarts>().record(
            recording,
            {.keys = frame.instance_keys[1], .counts = frame.counts, .tile_starts = frame.tile_starts},
            {.tiles = s.tiles, .capacity = frame.instance_capacity});
}

}  // namespace

gpu::BufferPart camera_part(const FrameInputs& inputs) {
    return {*inputs.camera.buffer, inputs.camera.offset, sizeof(shared::CameraBlock)};
}

uint32_t march_chunk(uint32_t samples, uint32_t most) {
    return std::min(std::bit_ceil(samples), most);
}

shared::BlendPush blend_push(const passes::KernelConfig& config, const FrameBuffers& frame,
                             const std::array<float, 3>& background) {
    const Sizes& s = frame.sizes;
    const auto steps = passes::tile_steps(config, s.tiles);
    return {.background = {background[0], background[1], background[2]},
            .image = s.image(),
            .tiles = {s.tiles_x, s.tiles_y},
            .tile_step = {steps[0], steps[1]},
            .capacity = frame.instance_capacity};
}

void record_tile_lists(gpu::Recording& recording, passes::PassCache& cache, bool gradients, uint32_t splats,
                       const FrameBuffers& frame) {
    const gpu::Buffer& order = record_depth_order(recording, cache, splats, frame);
    record_instances(recording, cache, gradients, splats, frame, order);
    record_tile_order(recording, cache, gradients, frame);
}

void record_projection(const FramePasses& on, const Model& model, const FrameInputs& inputs) {
    on.recording.fill(on.frame.counts, 0, 0,
                      inputs.keep_overflow ? offsetof(shared::Counts, overflowed) : sizeof(shared::Counts));
    if (on.plan.rays())
        record_project_rays(on, model, inputs);
    else
        record_project(on, model, inputs);
}

Sorted record_picture(const FramePasses& on, uint32_t splats, const FrameInputs& inputs) {
    const auto& [recording, cache, plan, frame] = on;
    record_tile_lists(recording, cache, plan.gradients, splats, frame);
    const uint32_t mode = kBlendModes[size_t(plan.drawing)];
    passes::Constants variant{{shared::SPEC_MODE, mode}};
    if (plan.rays()) {
        if (plan.integrator == Integrator::ray)
            record_integrate_as<passes::BlendRays>(on, inputs, mode);
        else
            record_integrate_as<passes::MarchRays>(
                on, inputs, march_chunk(inputs.samples, cache.config().texel_buffers ? 16 : 8));
    } else if (plan.points()) {
        variant.push_back({shared::SPEC_NEAREST, plan.nearest});
        record_blend_as<passes::BlendPoints>(on, inputs, variant);
    } else {
        variant.push_back({shared::SPEC_KERNEL, uint32_t(plan.kernel)});
        record_blend_as<passes::Blend>(on, inputs, variant);
    }
    return {.splats = &frame.instance_splats[1],
            .indices = plan.gradients ? &frame.sorted_indices[1] : nullptr};
}

Sorted record_forward(const FramePasses& on, const Model& model, const FrameInputs& inputs) {
    record_projection(on, model, inputs);
    return record_picture(on, model.splats, inputs);
}

}  // namespace ewa::pipeline
