// SPDX-License-Identifier: Apache-2.0
#include "pipeline/frame_passes.h"

#include "pipeline/methods.h"
#include "pipeline/sorting.h"

namespace ewa::pipeline {
namespace {

/// In the order of Drawing.
constexpr uint32_t kBlendModes[] = {shared::BLEND_COLOR,      shared::BLEND_DEPTH,  shared::BLEND_COUNT,
                                    shared::BLEND_ELLIPSOIDS, shared::BLEND_MEDIAN, shared::BLEND_COLOR};

/// What project writes in place of colours, and what it reads.
uint32_t project_mode(const Plan& plan) {
    const uint32_t surface = plan.drawing == Drawing::median_depth ? shared::PROJECT_SLOPES
                             : plan.drawing == Drawing::normal     ? shared::PROJECT_NORMALS
                                                                   : 0;
    return surface | (plan.debug ? shared::PROJECT_DEBUG : 0) |
           (plan.reads_marks() ? shared::PROJECT_MARKS : 0);
}

/// Leaves the splats in depth order in order[0]: later buffers may share the memory of the other one. Each pass of a sort writes
/// the other buffer of two, and the first pass reads none.
void record_depth_order(const passes::Recorder& on, uint32_t splats, const FrameBuffers& frame) {
    const uint32_t first = frame.sizes.depth_sort.passes % 2;
    record_sort(on,
                {.keys = {&frame.depth_keys[0], &frame.depth_keys[1]},
                 .values = {&frame.order[first], &frame.order[1 - first]},
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
}

/// In depth order, or in the order of the splats if their lists are sorted later.
void record_instances(const passes::Recorder& on, bool gradients, uint32_t splats, const FrameBuffers& frame,
                      bool wraps) {
    const Sizes& s = frame.sizes;
    record_scan(on,
                {.source = frame.tile_counts,
                 .order = s.sorted_lists ? nullptr : &frame.order[0],
                 .prefix = frame.prefix,
                 .totals = frame.scan_totals,
                 .counts = frame.counts},
                {.items = splats,
                 .block = s.scan_block,
                 .total = shared::TOTAL_INSTANCES,
                 .name = "instance offsets",
                 .capacity = frame.instance_capacity});
    on.record(passes::EmitInstances{.records = frame.records,
                                    .order = s.sorted_lists ? frame.tile_counts : frame.order[0],
                                    .tile_counts = frame.tile_counts,
                                    .prefix = frame.prefix,
                                    .totals = frame.scan_totals,
                                    .counts = frame.counts,
                                    .keys = frame.instance_keys[frame.tile_sort_start()],
                                    .splats = frame.emitted_splats(),
                                    .first_instances = frame.first_instances,
                                    .lists = s.sorted_lists ? frame.lists : frame.first_instances},
              {.splats = splats,
               .capacity = frame.instance_capacity,
               .scan_block = s.scan_block,
               .strip_rows = s.strip_rows,
               .size = {s.width, s.height},
               .tiles = {s.tiles_x, s.tiles_y}},
              {{shared::SPEC_MODE,
                (gradients ? shared::EMIT_FIRST_INSTANCES : 0) | (s.sorted_lists ? shared::EMIT_LISTS : 0)},
               {shared::SPEC_WRAP, wraps ? 1u : 0u},
               {shared::SPEC_QUADS, s.quads}});
}

/// The result is in the second buffers.
void record_tile_order(const passes::Recorder& on, bool gradients, const FrameBuffers& frame) {
    const bool emitted = frame.slots_emitted(), tracked = gradients && !emitted;
    const auto& values = emitted ? frame.sorted_indices : frame.instance_splats;
    // A splat must find its sorted slots again.
    const auto indices = [&](uint32_t i) { return tracked ? &frame.sorted_indices[i] : nullptr; };
    const uint32_t a = frame.tile_sort_start(), b = 1 - a;
    const Sizes& s = frame.sizes;
    record_sort(on,
                {.keys = {&frame.instance_keys[a], &frame.instance_keys[b]},
                 .values = {&values[a], &values[b]},
                 .indices = {indices(a), indices(b)},
                 .own_indices = emitted,
                 .counters = frame.counters,
                 .counter_prefix = frame.counter_prefix,
                 .digit_totals = frame.digit_totals,
                 .counts = frame.counts},
                {.cut = s.tile_sort,
                 .items = 0,
                 .capacity = frame.instance_capacity,
                 .keep_keys = s.tile_sort.passes > 1,
                 .name = "tile order",
                 .live = true});
    // The one digit of a sort in one pass is the tile.
    if (s.tile_sort.passes == 1)
        on.recording.copy(frame.digit_totals, 0, frame.tile_starts, 0, s.tile_starts);
    else
        on.record(
            passes::TileStarts{
                .keys = frame.instance_keys[1], .counts = frame.counts, .tile_starts = frame.tile_starts},
            {.tiles = s.tiles, .capacity = frame.instance_capacity});
}

/// Puts the instances into the tiles' lists and sorts each by depth. The result is where record_tile_order leaves it.
void record_lists(const passes::Recorder& on, bool gradients, const FrameBuffers& frame) {
    constexpr const char* kName = "tile order";
    const shared::ListPush push{.tiles = frame.sizes.tiles, .capacity = frame.instance_capacity};
    const bool emitted = frame.slots_emitted();
    const gpu::Buffer &keys = frame.instance_keys[1],
                      &instances = emitted ? frame.sorted_indices[1] : frame.instance_splats[1];
    on.record(passes::ScanLists{frame.lists, frame.tile_starts}, push, {}, kName);
    on.record(passes::FillLists{.tiles = frame.instance_keys[0],
                                .splats = frame.emitted_splats(),
                                .depth_keys = frame.depth_keys[0],
                                .counts = frame.counts,
                                .lists = frame.lists,
                                .keys = keys,
                                .instances = instances},
              push, {}, kName);
    // A binding that a mode does not use needs a buffer.
    on.record(passes::SortLists{.tile_starts = frame.tile_starts,
                                .keys = keys,
                                .instances = instances,
                                .splats = frame.emitted_splats(),
                                .places = gradients && !emitted ? frame.sorted_indices[1] : frame.lists},
              push,
              {{shared::SPEC_MODE, emitted     ? shared::LISTS_EMITTED
                                   : gradients ? shared::LISTS_TRACKED
                                               : shared::LISTS_SPLATS}},
              kName);
}

}  // namespace

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

void record_tile_lists(const passes::Recorder& on, bool gradients, uint32_t splats, const FrameBuffers& frame,
                       bool wraps) {
    const bool lists = frame.sizes.sorted_lists;
    if (lists)
        on.recording.fill(frame.lists, 0, 0, frame.sizes.lists);
    else
        record_depth_order(on, splats, frame);
    record_instances(on, gradients, splats, frame, wraps);
    if (lists)
        record_lists(on, gradients, frame);
    else
        record_tile_order(on, gradients, frame);
}

gpu::BufferPart FramePasses::camera() const {
    return {*inputs.camera.buffer, inputs.camera.offset, sizeof(shared::CameraBlock)};
}

gpu::SpecConstant FramePasses::degree() const {
    return {shared::SPEC_SH_DEGREE, plan.evaluated_degree(inputs.sh_degree)};
}

void FramePasses::clear_counts() const {
    recording.fill(frame.counts, 0, 0,
                   inputs.keep_overflow ? offsetof(shared::Counts, overflowed) : sizeof(shared::Counts));
}

void FramePasses::project(const Model& model) const {
    if (!inputs.prepared) clear_counts();
    const passes::ProjectBuffers buffers{.params = model.params,
                                         .camera = camera(),
                                         .records = frame.records,
                                         .depth_keys = frame.depth_keys[0],
                                         .tile_counts = frame.tile_counts,
                                         .counts = frame.counts};
    passes_of(*plan.method)
        .project(*this, buffers,
                 {.splats = model.splats,
                  .planes = model.planes(),
                  .log_scale_shift = plan.log_scale_shift,
                  .hidden_marks = plan.hidden_marks,
                  .tinted_marks = plan.tinted_marks},
                 {shared::SPEC_MODE, project_mode(plan)});
}

Sorted FramePasses::draw(uint32_t splats) const {
    record_tile_lists(*this, plan.gradients, splats, frame, inputs.camera.wraps);
    const passes::BlendBuffers buffers{.records = frame.records,
                                       .splats = frame.instance_splats[1],
                                       .tile_starts = frame.tile_starts,
                                       .planes = frame.planes};
    passes_of(*plan.method)
        .blend(*this, buffers, blend_push(cache.config(), frame, inputs.background),
               {shared::SPEC_MODE, kBlendModes[size_t(plan.drawing)]});
    if (inputs.sky.texels) add_sky();
    return {.splats = &frame.instance_splats[1],
            .indices = plan.gradients ? &frame.sorted_indices[1] : nullptr};
}

void FramePasses::contributions(const Sorted& sorted, const gpu::Buffer& largest) const {
    record_tiles(passes::Contribute{.records = frame.records,
                                    .splats = *sorted.splats,
                                    .tile_starts = frame.tile_starts,
                                    .largest = largest,
                                    .indices = sorted.indices ? *sorted.indices : *sorted.splats},
                 blend_push(cache.config(), frame, inputs.background), {kernel()});
}

Sorted FramePasses::forward(const Model& model) const {
    project(model);
    return draw(model.splats);
}

}  // namespace ewa::pipeline
