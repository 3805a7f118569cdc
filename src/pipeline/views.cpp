// SPDX-License-Identifier: Apache-2.0
#include "pipeline/views.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "ewa/error.h"
#include "passes/passes.h"
#include "pipeline/adam.h"
#include "pipeline/sorting.h"
#include "shared/constants.h"

namespace ewa::pipeline {
namespace {

constexpr uint64_t kRecordBytes = 16 * shared::RECORD_TEXELS;

void make_room(gpu::Device& device, gpu::Buffer& buffer, const char* name, uint64_t bytes,
               gpu::Texel texel = gpu::Texel::none) {
    if (buffer && buffer.bytes() >= bytes) return;
    buffer = gpu::Buffer();  // free the old one first: its contents are not needed
    buffer = gpu::Buffer(device, name, bytes, texel);
}

/// Adam's decay over several views.
float decay(double beta, uint32_t views) {
    return float(std::pow(beta, views));
}

shared::UpdateViewsPush update_views_push(const Model& model, const Rates& rates, uint32_t bands) {
    const AdamShares shares = adam_shares(rates.nesterov, rates.step, rates.views);
    return {.splats = model.splats,
            .first = model.first,
            .planes = model.planes(),
            .views = rates.views,
            .bands = bands,
            .share = 1.0f / float(rates.views),
            .mean_rate = rates.mean,
            .opacity_rate = rates.opacity,
            .quaternion_rate = rates.quaternion,
            .scale_rate = rates.scale,
            .sh0_rate = rates.sh0,
            .sh_rest_rate = rates.sh_rest,
            .beta1 = decay(shared::ADAM_BETA1, rates.views),
            .beta2 = decay(shared::ADAM_BETA2, rates.views),
            .epsilon = float(shared::ADAM_EPSILON / std::sqrt(rates.views)),
            .moment_share = shares.moment,
            .gradient_share = shares.gradient,
            .bias2 = adam_biases(rates.step)[1],
            .opacity_weight = rates.opacity_weight,
            .scale_weight = rates.scale_weight,
            .seed = {uint32_t(rates.seed), uint32_t(rates.seed >> 32)},
            .step = rates.step};
}

}  // namespace

uint64_t ViewBuffers::sum_bytes(const Plan& plan, uint64_t splats) {
    return 4 * splats *
           (plan.loss.depth > 0 ? shared::SUM_FLOATS_DEPTH
            : plan.absolute     ? shared::SUM_FLOATS_ABSOLUTE
                                : shared::SUM_FLOATS);
}

uint64_t ViewBuffers::most_bytes(const Plan& plan, uint64_t splats, uint64_t views, uint64_t bands) {
    return kRecordBytes * splats + views * (sizeof(shared::CameraBlock) + bands * 4 * splats +
                                            std::min<uint64_t>(bands, 2) * sum_bytes(plan, splats));
}

void ViewBuffers::reserve(gpu::Device& device, uint32_t splats, uint32_t views, uint32_t bands,
                          uint32_t records) {
    if (uint64_t(views) * bands * splats >= shared::NOT_LISTED)
        throw RunError(std::to_string(splats) + " splats are too many for " + std::to_string(views) +
                       " views a step in " + std::to_string(bands) +
                       " bands: take a smaller --batch or --bands");
    make_room(device, cameras, "cameras of a batch", sizeof(shared::CameraBlock) * uint64_t(views));
    make_room(device, list_indices, "list indices", 4 * uint64_t(views) * bands * splats);
    make_room(device, visible, "visible records", kRecordBytes * records, gpu::Texel::rgba32f);
}

void ViewBuffers::reserve_sums(gpu::Device& device, gpu::Executor& executor, const Plan& plan,
                               uint64_t splats) {
    const uint64_t bytes = sum_bytes(plan, splats);
    if (sums && sums.bytes() >= bytes) return;
    // A quarter more: the next views are of about this size.
    gpu::Buffer larger(device, "sums of a batch", bytes + bytes / 4);
    if (sums) {
        gpu::Recording recording(device.limits());
        recording.copy(sums, 0, larger, 0, sums.bytes());
        executor.run(recording);
    }
    sums = std::move(larger);
}

void FramePasses::list(const Model& model, const ViewBuffers& buffers, const ListStart& start,
                       bool projected) const {
    constexpr uint64_t kBlock = sizeof(shared::CameraBlock);
    const Band& band = inputs.band;
    if (!projected) {
        recording.copy(*inputs.camera.buffer, inputs.camera.offset, buffers.cameras, start.view * kBlock,
                       kBlock);
        project(model);
    }
    if (band.rows > 0)
        record(passes::BandTiles{.records = frame.records,
                                 .depth_keys = frame.depth_keys[0],
                                 .tile_counts = frame.tile_counts},
               {.splats = model.splats, .first_row = band.first, .size = {inputs.camera.width, band.rows}},
               {wrap(), quads()});
    record_scan(*this,
                {.source = frame.tile_counts,
                 .order = nullptr,
                 .prefix = frame.prefix,
                 .totals = frame.scan_totals,
                 .counts = frame.counts},
                {.items = model.splats,
                 .block = frame.sizes.scan_block,
                 .total = shared::TOTAL_SCAN,
                 .name = "visible splats",
                 .flags = true});
    record(passes::CollectVisible{.records = frame.records,
                                  .tile_counts = frame.tile_counts,
                                  .prefix = frame.prefix,
                                  .totals = frame.scan_totals,
                                  .list_indices = buffers.list_indices,
                                  .visible = buffers.visible},
           {.splats = model.splats,
            .scan_block = frame.sizes.scan_block,
            .list = start.list,
            .first_index = start.first_index,
            .first_record = start.first_record,
            .first_row = band.first});
}

Sorted FramePasses::draw_list(uint32_t splats) const {
    recording.fill(frame.counts, 0, 0, sizeof(shared::Counts));
    record(
        passes::ReceiveRecords{
            .records = frame.records, .depth_keys = frame.depth_keys[0], .tile_counts = frame.tile_counts},
        {.splats = splats, .size = {frame.sizes.width, frame.sizes.height}}, {wrap(), quads()});
    return draw(splats);
}

void FramePasses::list_backward(uint32_t splats, const Sorted& sorted, const gpu::Buffer& sums,
                                uint32_t first_index) const {
    blend_backward(sorted);
    record(passes::SumSlots{.records = frame.records,
                            .slots = frame.slots,
                            .tile_counts = frame.tile_counts,
                            .first_instances = frame.first_instances,
                            .sorted_indices = *sorted.indices,
                            .sums = sums},
           {.splats = splats, .first_index = first_index},
           {{shared::SPEC_MODE, (plan.absolute ? shared::UPDATE_ABSOLUTE : 0) |
                                    (plan.loss.depth > 0 ? shared::UPDATE_DEPTH : 0)},
            slots()});
}

void FramePasses::update_views(const Model& model, const ViewBuffers& buffers, const Rates& rates,
                               uint32_t bands) const {
    const gpu::Buffer& moments2 = model.second_moments();
    record(passes::UpdateViews{.params = model.params,
                               .cameras = buffers.cameras,
                               .list_indices = buffers.list_indices,
                               .sums = buffers.sums,
                               .moments1 = model.moments1,
                               .moments2 = moments2,
                               .counts = frame.counts,
                               .params_out = model.params,
                               .moments1_out = model.moments1,
                               .moments2_out = moments2,
                               // A binding that a mode does not use needs a buffer.
                               .statistics = plan.statistics ? model.statistics : frame.partials},
           update_views_push(model, rates, bands),
           {degree(),
            {shared::SPEC_MODE, update_mode(plan) | (bands > 1 ? shared::UPDATE_BANDS : 0)},
            kernel(),
            lenses()});
}

Rates batch_rates(const Rates& rates) {
    Rates r = rates;
    const float factor = float(std::sqrt(double(rates.views)));
    for (float* rate : {&r.mean, &r.opacity, &r.quaternion, &r.scale, &r.sh0, &r.sh_rest}) *rate *= factor;
    return r;
}

}  // namespace ewa::pipeline
