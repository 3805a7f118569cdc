// SPDX-License-Identifier: Apache-2.0
#include "train/chunk_batch.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace ewa::train {

using namespace pipeline;

namespace {

constexpr uint64_t kListedBytes = 16 * shared::RECORD_TEXELS;

shared::Counts counted_run(const BatchParts& parts, gpu::Recording& recording) {
    parts.frame.record_counts(recording);
    parts.executor.run(recording, true);
    parts.submitted();
    return parts.frame.read_counts();
}

}  // namespace

uint64_t ChunkBatch::Seen::all() const {
    return std::accumulate(listed.begin(), listed.end(), uint64_t(0));
}

uint64_t ChunkBatch::Seen::before(int chunk) const {
    return std::accumulate(listed.begin(), listed.begin() + chunk, uint64_t(0));
}

void ChunkBatch::reserve(const BatchParts& parts, FrameRequest request, uint64_t splats) {
    request.splats = uint32_t(std::max<uint64_t>(splats, 1));
    request.instances = parts.instance_capacity;
    parts.frame.reserve(parts.cache.device(), parts.cache.config(), request);
}

/// Lists what all views see of a chunk, so that its parameters are needed once.
void ChunkBatch::list(const BatchParts& parts, Chunks& chunks, std::span<const BatchView> views, int chunk,
                      const Model& model) {
    gpu::Device& device = parts.cache.device();
    buffers_.places = chunks.take_places();
    buffers_.reserve(device, model.splats, uint32_t(views.size()), 1, model.splats);
    uint64_t places = 0;
    for (size_t v = 0; v < views.size(); ++v) {
        reserve(parts, views[v].request, model.splats);
        gpu::Recording recording(device.limits());
        record_list(recording, parts.cache, parts.plan, model, parts.frame, views[v].inputs, buffers_,
                    {.view = uint32_t(v), .list = uint32_t(v), .first_place = uint32_t(places)});
        const shared::Counts counts = counted_run(parts, recording);
        Seen& seen = seen_[v];
        seen.listed[size_t(chunk)] = counts.scan_total;
        seen.records[size_t(chunk)].resize(counts.scan_total * kListedBytes);
        chunks.stream(counts.scan_total * kListedBytes,
                      [&] { buffers_.visible.download(std::span<std::byte>(seen.records[size_t(chunk)])); });
        seen.skipped += counts.skipped_nonfinite;
        places += counts.scan_total;
    }
    chunks.keep_places(std::move(buffers_.places));
}

shared::Counts ChunkBatch::draw_until_it_fits(const BatchParts& parts, const BatchView& view, uint32_t splats,
                                              const std::vector<std::byte>& records) {
    for (;;) {
        reserve(parts, view.request, splats);
        gpu::Recording recording(parts.cache.device().limits());
        if (records.empty())
            recording.fill(parts.frame.records, 0, 0, kListedBytes);
        else
            parts.frame.records.upload(std::span<const std::byte>(records));
        const Sorted sorted =
            record_list_forward(recording, parts.cache, parts.plan, splats, parts.frame, view.inputs);
        view.record_loss(recording, view.inputs);
        record_list_backward(recording, parts.cache, parts.plan, splats, parts.frame, view.inputs, sorted,
                             buffers_.sums, 0);
        const shared::Counts counts = counted_run(parts, recording);
        if (counts.instances <= parts.frame.instance_capacity) return counts;
        parts.instance_capacity = grown_capacity(counts.instances);
    }
}

void ChunkBatch::make_room_for_sums(const BatchParts& parts, uint64_t splats) {
    const uint64_t bytes = ViewBuffers::sum_bytes(parts.plan, splats);
    if (buffers_.sums && buffers_.sums.bytes() >= bytes) return;
    buffers_.sums = {};  // free the old ones first
    buffers_.sums = gpu::Buffer(parts.cache.device(), "sums of a view", bytes + bytes / 8);
}

void ChunkBatch::draw(const BatchParts& parts, Chunks& chunks, const BatchView& view, Seen& seen) {
    const uint64_t listed = seen.all();
    std::vector<std::byte> records;
    records.reserve(listed * kListedBytes);
    for (std::vector<std::byte>& of_chunk : seen.records) {
        records.insert(records.end(), of_chunk.begin(), of_chunk.end());
        of_chunk = {};
    }
    // A view without a splat draws one that is not visible.
    const uint32_t splats = uint32_t(std::max<uint64_t>(listed, 1));
    make_room_for_sums(parts, splats);
    const shared::Counts counts = draw_until_it_fits(parts, view, splats, records);
    seen.loss = loss_of(counts);
    seen.psnr = -10 * std::log10(double(counts.squared) / view.weight());
    seen.sums.resize(ViewBuffers::sum_bytes(parts.plan, listed));
    chunks.stream(records.size() + seen.sums.size(),
                  [&] { buffers_.sums.download(std::span<std::byte>(seen.sums)); });
}

void ChunkBatch::upload_sums(const BatchParts& parts, Chunks& chunks, int chunk) {
    uint64_t places = 0;
    for (const Seen& seen : seen_) places += seen.listed[size_t(chunk)];
    make_room_for_sums(parts, places + 1);
    uint64_t to = 0;
    for (const Seen& seen : seen_) {
        const uint64_t from = ViewBuffers::sum_bytes(parts.plan, seen.before(chunk)),
                       bytes = ViewBuffers::sum_bytes(parts.plan, seen.listed[size_t(chunk)]);
        chunks.stream(bytes, [&] {
            buffers_.sums.upload(std::span<const std::byte>(seen.sums).subspan(from, bytes), to);
        });
        to += bytes;
    }
}

BatchReport ChunkBatch::step(const BatchParts& parts, Chunks& chunks, std::span<const BatchView> views,
                             const Rates& rates, int sh_degree,
                             const std::function<void(gpu::Recording&, const Model&)>& more) {
    BatchReport report;
    seen_.assign(views.size(), Seen(size_t(chunks.count())));
    chunks.visit(Chunks::Need::params,
                 [&](int chunk, const Model& model) { list(parts, chunks, views, chunk, model); });
    buffers_.visible = {};  // the picture takes its memory
    for (size_t v = 0; v < views.size(); ++v) {
        draw(parts, chunks, views[v], seen_[v]);
        report.loss += seen_[v].loss / double(views.size());
        report.psnr += seen_[v].psnr / double(views.size());
    }
    report.skipped_nonfinite = seen_.back().skipped;
    chunks.visit(Chunks::Need::state, [&](int chunk, const Model& model) {
        buffers_.places = chunks.take_places();
        upload_sums(parts, chunks, chunk);
        gpu::Recording recording(parts.cache.device().limits());
        recording.fill(parts.frame.counts, 0, 0, sizeof(shared::Counts));
        record_update_views(recording, parts.cache, parts.plan, model, parts.frame, buffers_, rates,
                            model.share.first, sh_degree);
        if (more) more(recording, model);
        const shared::Counts counts = counted_run(parts, recording);
        chunks.changed();
        buffers_.places = {};
        report.dropped_updates += counts.dropped_updates;
        report.limited_steps += counts.limited_steps;
    });
    seen_.clear();
    return report;
}

}  // namespace ewa::train
