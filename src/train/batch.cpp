// SPDX-License-Identifier: Apache-2.0
#include "train/batch.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <numeric>

namespace ewa::train {

using namespace pipeline;

namespace {

constexpr uint64_t kRecordBytes = 16 * shared::RECORD_TEXELS;

/// A part of a device buffer as the host reads it: its memory, or a copy.
class Sent {
  public:
    Sent(const gpu::Buffer& buffer, uint64_t offset, uint64_t bytes) {
        if (bytes == 0) return;
        if (const std::byte* memory = buffer.readable()) {
            bytes_ = {memory + offset, bytes};
            return;
        }
        copy_.resize(bytes);
        buffer.download(std::span<std::byte>(copy_), offset);
        bytes_ = copy_;
    }
    std::span<const std::byte> part(uint64_t offset, uint64_t bytes) const {
        return bytes_.subspan(offset, bytes);
    }

  private:
    std::vector<std::byte> copy_;
    std::span<const std::byte> bytes_;
};

/// A part of a device buffer as the host fills it.
class Received {
  public:
    Received(gpu::Buffer& buffer, uint64_t offset, uint64_t bytes) : buffer_(buffer), offset_(offset) {
        if (bytes == 0) return;
        if (buffer.readable()) {
            bytes_ = {buffer.mapped() + offset, bytes};
            return;
        }
        copy_.resize(bytes);
        bytes_ = copy_;
    }
    std::span<std::byte> part(uint64_t offset, uint64_t bytes) const { return bytes_.subspan(offset, bytes); }
    /// Called when all parts are filled.
    void finish() {
        if (!copy_.empty()) buffer_.upload(std::span<const std::byte>(copy_), offset_);
    }

  private:
    gpu::Buffer& buffer_;
    uint64_t offset_;
    std::vector<std::byte> copy_;
    std::span<std::byte> bytes_;
};

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point begin) {
    return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

shared::Counts run(const BatchParts& parts, gpu::Recording& recording) {
    parts.frame.record_counts(recording);
    parts.executor.run(recording, true);
    parts.submitted();
    return parts.frame.read_counts();
}

}  // namespace

std::vector<uint64_t> Batch::gather(std::span<const uint64_t> own) {
    const auto begin = Clock::now();
    std::vector<uint64_t> all = ranks_->gather(own);
    traffic_.waiting += milliseconds_since(begin);
    return all;
}

void Batch::exchange(std::span<const std::span<const std::byte>> out,
                     std::span<const std::span<std::byte>> in) {
    const auto begin = Clock::now();
    ranks_->exchange(out, in);
    traffic_.exchange += milliseconds_since(begin);
    for (size_t rank = 0; rank < out.size(); ++rank)
        if (rank != size_t(ranks_->rank())) traffic_.sent_bytes += out[rank].size();
}

/// Views that are drawn at one time: at most one by each rank. View `first` + k is drawn by rank k.
struct Batch::Round {
    size_t first = 0, views = 0;
    std::vector<uint64_t> listed;  // by this rank, of each view
    std::vector<uint32_t> places;  // of the first of them
    std::vector<uint64_t> of_own;  // listed by each rank, of the view that this rank draws
    uint64_t skipped = 0;          // of the last view
    bool draws(int rank) const { return size_t(rank) < views; }
    uint64_t own() const { return std::accumulate(of_own.begin(), of_own.end(), uint64_t(0)); }
};

void Batch::reserve(const BatchParts& parts, FrameRequest request, uint64_t listed) {
    request.splats = uint32_t(std::max<uint64_t>(parts.model.splats, listed));
    request.instances = parts.instance_capacity;
    parts.frame.reserve(parts.cache.device(), parts.cache.config(), request);
}

void Batch::list(const BatchParts& parts, std::span<const BatchView> views, Round& round) {
    gpu::Device& device = parts.cache.device();
    const uint32_t splats = parts.model.splats;
    buffers_.reserve(device, splats, uint32_t(views.size()), uint32_t(round.views * splats));
    uint64_t records = 0;
    for (size_t k = 0; k < round.views; ++k) {
        const size_t view = round.first + k;
        reserve(parts, views[view].request, 0);
        gpu::Recording recording(device.limits());
        record_list(recording, parts.cache, parts.plan, parts.model, parts.frame, views[view].inputs,
                    buffers_, uint32_t(view), places_, uint32_t(records));
        const shared::Counts counts = run(parts, recording);
        round.places.push_back(places_);
        round.listed.push_back(counts.scan_total);
        round.skipped = counts.skipped_nonfinite;
        records += counts.scan_total;
        places_ += counts.scan_total;
    }
    // A view without a splat draws one that is not visible, which has a place behind the others.
    buffers_.reserve_sums(device, parts.executor, parts.plan, uint64_t(places_) + 1);
}

void Batch::tell_counts(Round& round, BatchReport& report) {
    const size_t ranks = size_t(ranks_->size()), own = size_t(ranks_->rank());
    std::vector<uint64_t> told = round.listed;
    told.push_back(round.skipped);
    const std::vector<uint64_t> all = gather(told);
    report.skipped_nonfinite = 0;
    for (size_t rank = 0; rank < ranks; ++rank) {
        round.of_own.push_back(round.draws(int(own)) ? all[rank * told.size() + own] : 0);
        report.skipped_nonfinite += all[rank * told.size() + round.views];
    }
}

void Batch::send_records(const BatchParts& parts, const Round& round) {
    const size_t ranks = size_t(ranks_->size());
    const uint64_t listed = std::accumulate(round.listed.begin(), round.listed.end(), uint64_t(0));
    const Sent records(buffers_.visible, 0, listed * kRecordBytes);
    Received list(parts.frame.records, 0, round.own() * kRecordBytes);
    std::vector<std::span<const std::byte>> out(ranks);
    std::vector<std::span<std::byte>> in(ranks);
    uint64_t from = 0, to = 0;
    for (size_t rank = 0; rank < ranks; ++rank) {
        if (rank < round.views) out[rank] = records.part(from, round.listed[rank] * kRecordBytes);
        in[rank] = list.part(to, round.of_own[rank] * kRecordBytes);
        from += out[rank].size();
        to += in[rank].size();
    }
    exchange(out, in);
    list.finish();
}

void Batch::return_sums(const BatchParts& parts, const Round& round) {
    const size_t ranks = size_t(ranks_->size());
    const uint64_t splat = ViewBuffers::sum_bytes(parts.plan, 1);
    const uint64_t listed = std::accumulate(round.listed.begin(), round.listed.end(), uint64_t(0));
    const Sent drawn(own_sums_, 0, round.own() * splat);
    Received sums(buffers_.sums, round.places.front() * splat, listed * splat);
    std::vector<std::span<const std::byte>> out(ranks);
    std::vector<std::span<std::byte>> in(ranks);
    uint64_t from = 0, to = 0;
    for (size_t rank = 0; rank < ranks; ++rank) {
        out[rank] = drawn.part(from, round.of_own[rank] * splat);
        if (rank < round.views) in[rank] = sums.part(to, round.listed[rank] * splat);
        from += out[rank].size();
        to += in[rank].size();
    }
    exchange(out, in);
    sums.finish();
}

shared::Counts Batch::draw_own(const BatchParts& parts, const BatchView& view, const Round& round) {
    gpu::Device& device = parts.cache.device();
    const bool alone = ranks_->size() == 1;
    const uint64_t listed = round.own();
    const uint32_t splats = uint32_t(std::max<uint64_t>(listed, 1));
    const gpu::Buffer& sums = alone ? buffers_.sums : own_sums_;
    for (;;) {
        reserve(parts, view.request, listed);
        gpu::Recording recording(device.limits());
        if (listed == 0)
            recording.fill(parts.frame.records, 0, 0, kRecordBytes);
        else if (alone)
            recording.copy(buffers_.visible, 0, parts.frame.records, 0, listed * kRecordBytes);
        const Sorted sorted =
            record_list_forward(recording, parts.cache, parts.plan, splats, parts.frame, view.inputs);
        if (view.record_loss) {
            view.record_loss(recording);
            record_list_backward(recording, parts.cache, parts.plan, splats, parts.frame, view.inputs, sorted,
                                 sums, alone ? round.places.front() : 0);
        }
        const shared::Counts counts = run(parts, recording);
        if (counts.instances <= parts.frame.instance_capacity) return counts;
        parts.instance_capacity = grown_capacity(counts.instances);
    }
}

/// Afterwards each rank has the list of the view that it draws.
void Batch::exchange_lists(const BatchParts& parts, std::span<const BatchView> views, Round& round,
                           BatchReport& report) {
    list(parts, views, round);
    tell_counts(round, report);
    if (ranks_->size() == 1) return;
    const int own = ranks_->rank();
    if (round.draws(own)) {
        reserve(parts, views[round.first + size_t(own)].request, round.own());
        make_room_for_own(parts, round.own());
    }
    send_records(parts, round);
}

bool Batch::draw_pictures(const BatchParts& parts, std::span<const BatchView> views) {
    BatchReport report;
    places_ = 0;
    Round round{0, views.size(), {}, {}, {}};
    exchange_lists(parts, views, round, report);
    const bool draws = round.draws(ranks_->rank());
    if (draws) draw_own(parts, views[size_t(ranks_->rank())], round);
    return draws;
}

BatchReport Batch::draw(const BatchParts& parts, std::span<const BatchView> views) {
    BatchReport report;
    const int ranks = ranks_->size(), own = ranks_->rank();
    places_ = 0;
    for (size_t first = 0; first < views.size(); first += size_t(ranks)) {
        Round round{first, std::min(size_t(ranks), views.size() - first), {}, {}, {}};
        exchange_lists(parts, views, round, report);
        std::array<double, 2> losses{};
        if (round.draws(own)) {
            const BatchView& view = views[first + size_t(own)];
            const shared::Counts counts = draw_own(parts, view, round);
            losses = {loss_of(counts), view.psnr(counts)};
        }
        // Waits for the slowest of them.
        const auto words = std::bit_cast<std::array<uint64_t, 2>>(losses);
        const std::vector<uint64_t> all = gather(words);
        if (ranks > 1) return_sums(parts, round);
        for (size_t k = 0; k < round.views; ++k) {
            report.loss += std::bit_cast<double>(all[2 * k]) / double(views.size());
            report.psnr += std::bit_cast<double>(all[2 * k + 1]) / double(views.size());
        }
    }
    return report;
}

void Batch::make_room_for_own(const BatchParts& parts, uint64_t listed) {
    const uint64_t bytes = ViewBuffers::sum_bytes(parts.plan, listed + 1);
    if (own_sums_ && own_sums_.bytes() >= bytes) return;
    own_sums_ = gpu::Buffer();
    own_sums_ = gpu::Buffer(parts.cache.device(), "sums of a view", bytes + bytes / 4);
}

void Batch::update(const BatchParts& parts, const Rates& rates, uint32_t first, int sh_degree,
                   const std::function<void(gpu::Recording&)>& more, BatchReport& report) {
    gpu::Recording recording(parts.cache.device().limits());
    recording.fill(parts.frame.counts, 0, 0, sizeof(shared::Counts));
    record_update_views(recording, parts.cache, parts.plan, parts.model, parts.frame, buffers_, rates, first,
                        sh_degree);
    if (more) more(recording);
    const shared::Counts counts = run(parts, recording);
    const std::vector<uint64_t> all =
        gather(std::array<uint64_t, 2>{counts.dropped_updates, counts.limited_steps});
    for (size_t i = 0; i < all.size(); i += 2) {
        report.dropped_updates += all[i];
        report.limited_steps += all[i + 1];
    }
}

}  // namespace ewa::train
