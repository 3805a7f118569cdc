// SPDX-License-Identifier: Apache-2.0
#include "train/batch.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
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

/// Parts of the loss of a view.
struct PictureLoss {
    double l1 = 0, ssim = 0, squared = 0;
};

PictureLoss loss_from(std::span<const uint64_t, 3> words) {
    return {std::bit_cast<double>(words[0]), std::bit_cast<double>(words[1]),
            std::bit_cast<double>(words[2])};
}

/// losses: of the bands of each view.
void add_losses(std::span<const PictureLoss> losses, size_t bands, BatchReport& report) {
    const size_t views = losses.size() / bands;
    for (size_t first = 0; first < losses.size(); first += bands) {
        PictureLoss view = losses[first];
        for (const PictureLoss& band : losses.subspan(first + 1, bands - 1)) {
            view.l1 += band.l1;
            view.ssim += band.ssim;
            view.squared += band.squared;
        }
        report.loss += loss_of(view.l1, view.ssim) / double(views);
        report.psnr += -10 * std::log10(view.squared) / double(views);
    }
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

/// A view, or a band of it, which one rank draws.
struct Batch::Picture {
    size_t number;  // among those of all views: that of its list
    size_t view;
    const BatchView& of;
    FrameInputs inputs;    // with its band
    FrameRequest request;  // without splats and instances
};

/// Pictures that are drawn at one time: at most one by each rank. Picture `first` + k is drawn by rank k.
struct Batch::Round {
    uint32_t bands;  // of each view
    size_t first = 0, pictures = 0;
    std::vector<uint64_t> listed;  // by this rank, of each picture
    std::vector<uint32_t> places;  // of the first of them
    std::vector<uint64_t> of_own;  // listed by each rank, of the picture that this rank draws
    uint64_t skipped = 0;          // of the last view
    bool draws(int rank) const { return size_t(rank) < pictures; }
    uint64_t own() const { return std::accumulate(of_own.begin(), of_own.end(), uint64_t(0)); }
};

void Batch::reserve(const BatchParts& parts, FrameRequest request, uint64_t listed) {
    request.splats = uint32_t(std::max<uint64_t>(parts.model.splats, listed));
    request.instances = parts.instance_capacity;
    parts.frame.reserve(parts.cache.device(), parts.cache.config(), request);
}

Batch::Picture Batch::picture_of(const BatchParts& parts, std::span<const BatchView> views,
                                 const Round& round, size_t rank) {
    const size_t number = round.first + rank, view = number / round.bands;
    Picture picture{number, view, views[view], views[view].inputs, views[view].request};
    if (round.bands == 1) return picture;
    picture.inputs.band =
        band_of(parts.cache.config(), picture.request.height, round.bands, uint32_t(number % round.bands));
    picture.request.height = picture.inputs.band.rows;
    return picture;
}

void Batch::list(const BatchParts& parts, std::span<const BatchView> views, Round& round) {
    gpu::Device& device = parts.cache.device();
    const uint32_t splats = parts.model.splats;
    buffers_.reserve(device, splats, uint32_t(views.size()), round.bands, uint32_t(round.pictures * splats));
    uint64_t records = 0;
    size_t projected = views.size();
    for (size_t k = 0; k < round.pictures; ++k) {
        const Picture picture = picture_of(parts, views, round, k);
        const bool again = picture.view == projected;
        if (!again) reserve(parts, picture.request, 0);
        projected = picture.view;
        gpu::Recording recording(device.limits());
        record_list(recording, parts.cache, parts.plan, parts.model, parts.frame, picture.inputs, buffers_,
                    {.view = uint32_t(picture.view),
                     .list = uint32_t(picture.number),
                     .first_place = places_,
                     .first_record = uint32_t(records)},
                    again);
        const shared::Counts counts = run(parts, recording);
        round.places.push_back(places_);
        round.listed.push_back(counts.scan_total);
        round.skipped = counts.skipped_nonfinite;
        records += counts.scan_total;
        places_ += counts.scan_total;
    }
    // A picture without a splat draws one that is not visible, which has a place behind the others.
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
        report.skipped_nonfinite += all[rank * told.size() + round.pictures];
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
        if (rank < round.pictures) out[rank] = records.part(from, round.listed[rank] * kRecordBytes);
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
        if (rank < round.pictures) in[rank] = sums.part(to, round.listed[rank] * splat);
        from += out[rank].size();
        to += in[rank].size();
    }
    exchange(out, in);
    sums.finish();
}

shared::Counts Batch::draw_own(const BatchParts& parts, const Picture& picture, const Round& round) {
    gpu::Device& device = parts.cache.device();
    const bool alone = ranks_->size() == 1;
    const uint64_t listed = round.own();
    const uint32_t splats = uint32_t(std::max<uint64_t>(listed, 1));
    const gpu::Buffer& sums = alone ? buffers_.sums : own_sums_;
    for (;;) {
        reserve(parts, picture.request, listed);
        gpu::Recording recording(device.limits());
        if (listed == 0)
            recording.fill(parts.frame.records, 0, 0, kRecordBytes);
        else if (alone)
            recording.copy(buffers_.visible, 0, parts.frame.records, 0, listed * kRecordBytes);
        const Sorted sorted =
            record_list_forward(recording, parts.cache, parts.plan, splats, parts.frame, picture.inputs);
        if (picture.of.record_loss) {
            picture.of.record_loss(recording, picture.inputs);
            record_list_backward(recording, parts.cache, parts.plan, splats, parts.frame, picture.inputs,
                                 sorted, sums, alone ? round.places.front() : 0);
        }
        const shared::Counts counts = run(parts, recording);
        if (counts.instances <= parts.frame.instance_capacity) return counts;
        parts.instance_capacity = grown_capacity(counts.instances);
    }
}

/// Afterwards each rank has the list of the picture that it draws.
void Batch::exchange_lists(const BatchParts& parts, std::span<const BatchView> views, Round& round,
                           BatchReport& report) {
    list(parts, views, round);
    tell_counts(round, report);
    if (ranks_->size() == 1) return;
    const int own = ranks_->rank();
    if (round.draws(own)) {
        reserve(parts, picture_of(parts, views, round, size_t(own)).request, round.own());
        make_room_for_own(parts, round.own());
    }
    send_records(parts, round);
}

bool Batch::draw_pictures(const BatchParts& parts, std::span<const BatchView> views) {
    BatchReport report;
    places_ = 0;
    Round round{1, 0, views.size(), {}, {}, {}};
    exchange_lists(parts, views, round, report);
    const bool draws = round.draws(ranks_->rank());
    if (draws) draw_own(parts, picture_of(parts, views, round, size_t(ranks_->rank())), round);
    return draws;
}

BatchReport Batch::draw(const BatchParts& parts, std::span<const BatchView> views) {
    BatchReport report;
    const int ranks = ranks_->size(), own = ranks_->rank();
    std::vector<PictureLoss> losses(views.size() * bands_);
    places_ = 0;
    for (size_t first = 0; first < losses.size(); first += size_t(ranks)) {
        Round round{bands_, first, std::min(size_t(ranks), losses.size() - first), {}, {}, {}};
        exchange_lists(parts, views, round, report);
        PictureLoss loss{};
        if (round.draws(own)) {
            const Picture picture = picture_of(parts, views, round, size_t(own));
            const shared::Counts counts = draw_own(parts, picture, round);
            loss = {counts.l1, counts.ssim, double(counts.squared) / picture.of.weight()};
        }
        // Waits for the slowest of them.
        const std::vector<uint64_t> all = gather(std::bit_cast<std::array<uint64_t, 3>>(loss));
        if (ranks > 1) return_sums(parts, round);
        for (size_t k = 0; k < round.pictures; ++k)
            losses[first + k] = loss_from(std::span(all).subspan(3 * k).first<3>());
    }
    add_losses(losses, bands_, report);
    return report;
}

void Batch::make_room_for_own(const BatchParts& parts, uint64_t listed) {
    const uint64_t bytes = ViewBuffers::sum_bytes(parts.plan, listed + 1);
    if (own_sums_ && own_sums_.bytes() >= bytes) return;
    own_sums_ = gpu::Buffer();
    own_sums_ = gpu::Buffer(parts.cache.device(), "sums of a picture", bytes + bytes / 4);
}

void Batch::update(const BatchParts& parts, const Rates& rates, uint32_t first, int sh_degree,
                   const std::function<void(gpu::Recording&)>& more, BatchReport& report) {
    gpu::Recording recording(parts.cache.device().limits());
    recording.fill(parts.frame.counts, 0, 0, sizeof(shared::Counts));
    record_update_views(recording, parts.cache, parts.plan, parts.model, parts.frame, buffers_, rates, first,
                        sh_degree, bands_);
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
