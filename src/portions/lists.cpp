// SPDX-License-Identifier: Apache-2.0
#include "portions/lists.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace ewa::portions {

uint64_t sum_of(std::span<const uint64_t> values) {
    return std::accumulate(values.begin(), values.end(), uint64_t(0));
}

std::vector<std::span<std::byte>> pieces_of(std::span<std::byte> all, std::span<const uint64_t> values,
                                            uint64_t bytes, size_t ranks) {
    std::vector<std::span<std::byte>> pieces(ranks);
    uint64_t at = 0;
    for (size_t rank = 0; rank < values.size(); at += pieces[rank++].size())
        pieces[rank] = all.subspan(at, values[rank] * bytes);
    return pieces;
}

OnHost::OnHost(gpu::Buffer& buffer, uint64_t offset, uint64_t bytes) : buffer_(buffer), offset_(offset) {
    if (bytes == 0) return;
    if (buffer.readable()) {
        bytes_ = {buffer.mapped() + offset, bytes};
        return;
    }
    copy_.resize(bytes);
    bytes_ = copy_;
}

void OnHost::read() {
    if (!copy_.empty()) buffer_.download(std::span<std::byte>(copy_), offset_);
}

void OnHost::write() {
    if (!copy_.empty()) buffer_.upload(std::span<const std::byte>(copy_), offset_);
}

void make_room(gpu::Device& device, gpu::Buffer& buffer, const char* name, uint64_t bytes) {
    if (buffer && buffer.bytes() >= bytes) return;
    buffer = gpu::Buffer();  // free the old one first
    buffer = gpu::Buffer(device, name, bytes + bytes / 8);
}

namespace {

/// One portion: its lists are drawn at once, and the frame has room for it and for a list.
class DeviceLists : public Lists {
  public:
    explicit DeviceLists(gpu::Device& device) : device_(device) {}

    size_t at_once(size_t, size_t ranks) const override { return ranks; }
    uint64_t room(uint64_t splats, uint64_t largest) const override { return std::max(splats, largest); }
    uint64_t records(uint64_t splats, uint64_t view_parts) const override { return view_parts * splats; }
    uint64_t take(StepBuffers&, Seen& seen, size_t portion) override { return seen.listed[portion]; }
    void end_portion(gpu::Executor& executor, const pipeline::Plan& plan, StepBuffers& of,
                     uint64_t indices) override {
        // A part without a splat draws one that is not visible, which has a list index behind the others.
        of.portion.reserve_sums(device_, executor, plan, indices + 1);
    }
    void end_all(StepBuffers&) override {}

    void send(StepBuffers& of, const Turn& turn, size_t ranks, const Use& use) override {
        OnHost lists(of.portion.visible, 0, sum_of(turn.listed) * kRecordBytes);
        lists.read();
        use(pieces_of(lists.bytes(), turn.listed, kRecordBytes, ranks));
    }
    void receive(StepBuffers& of, const Turn& turn, size_t ranks, uint64_t bytes, const Use& use) override {
        OnHost sums(of.portion.sums, of.seen[turn.first].first_indices.front() * bytes,
                    sum_of(turn.listed) * bytes);
        use(pieces_of(sums.bytes(), turn.listed, bytes, ranks));
        sums.write();
    }
    void begin_update(StepBuffers&, size_t, uint64_t) override {}
    gpu::Buffer end_update(StepBuffers& of) override { return std::move(of.portion.list_indices); }

  private:
    gpu::Device& device_;
};

/// Several portions: the lists of all wait in host memory.
class HostLists : public Lists {
  public:
    HostLists(gpu::Device& device, Streaming& streaming) : device_(device), streaming_(streaming) {}

    size_t at_once(size_t view_parts, size_t) const override { return view_parts; }
    uint64_t room(uint64_t splats, uint64_t) const override { return std::max<uint64_t>(splats, 1); }
    uint64_t records(uint64_t splats, uint64_t) const override { return splats; }
    uint64_t take(StepBuffers& of, Seen& seen, size_t portion) override {
        std::vector<std::byte>& records = seen.records[portion];
        records.resize(seen.listed[portion] * kRecordBytes);
        streaming_.stream(records.size(),
                          [&] { of.portion.visible.download(std::span<std::byte>(records)); });
        return 0;
    }
    void end_portion(gpu::Executor&, const pipeline::Plan&, StepBuffers&, uint64_t) override {}
    /// The part that is drawn takes the memory.
    void end_all(StepBuffers& of) override { of.portion.visible = {}; }

    void send(StepBuffers& of, const Turn& turn, size_t ranks, const Use& use) override {
        std::vector<std::vector<std::byte>> joined(ranks);
        for (size_t rank = 0; rank < turn.view_parts; ++rank)
            for (std::vector<std::byte>& records : of.seen[turn.first + rank].records) {
                joined[rank].insert(joined[rank].end(), records.begin(), records.end());
                records = {};
            }
        use(std::vector<std::span<std::byte>>(joined.begin(), joined.end()));
    }
    void receive(StepBuffers& of, const Turn& turn, size_t ranks, uint64_t bytes, const Use& use) override {
        std::vector<std::span<std::byte>> sums(ranks);
        for (size_t rank = 0; rank < turn.view_parts; ++rank) {
            std::vector<std::byte>& waiting = of.seen[turn.first + rank].sums;
            waiting.resize(turn.listed[rank] * bytes);
            sums[rank] = waiting;
        }
        use(sums);
    }
    void begin_update(StepBuffers& of, size_t portion, uint64_t splat) override {
        const Seen& last = of.seen.back();
        of.portion.sums = std::move(of.own_sums);
        make_room(device_, of.portion.sums, "sums of a view's part",
                  (last.first_indices[portion] + last.listed[portion] + 1) * splat);
        for (const Seen& seen : of.seen) {
            const uint64_t from = sum_of(std::span(seen.listed).first(portion)) * splat,
                           bytes = seen.listed[portion] * splat;
            streaming_.stream(bytes, [&] {
                of.portion.sums.upload(std::span<const std::byte>(seen.sums).subspan(from, bytes),
                                       seen.first_indices[portion] * splat);
            });
        }
    }
    gpu::Buffer end_update(StepBuffers& of) override {
        of.portion.list_indices = {};
        of.own_sums = std::move(of.portion.sums);
        return {};
    }

  private:
    gpu::Device& device_;
    Streaming& streaming_;
};

}  // namespace

std::unique_ptr<Lists> lists_on_device(gpu::Device& device) {
    return std::make_unique<DeviceLists>(device);
}

std::unique_ptr<Lists> lists_in_host_memory(gpu::Device& device, Streaming& streaming) {
    return std::make_unique<HostLists>(device, streaming);
}

}  // namespace ewa::portions
