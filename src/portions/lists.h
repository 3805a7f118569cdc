// SPDX-License-Identifier: Apache-2.0
// The lists of a step until a part of a view is drawn from them, and the sums of its gradients until the portions are updated.
// They wait in buffers of the device, or in host memory.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "pipeline/views.h"

namespace ewa::portions {

constexpr uint64_t kRecordBytes = 16 * shared::RECORD_TEXELS;

uint64_t sum_of(std::span<const uint64_t> values);

/// A piece of `all` for each rank, one after another: so many values of so many bytes. Ranks without a number get none.
std::vector<std::span<std::byte>> pieces_of(std::span<std::byte> all, std::span<const uint64_t> values,
                                            uint64_t bytes, size_t ranks);

/// A part of a device buffer on the host: its memory, or a copy.
class OnHost {
  public:
    OnHost(gpu::Buffer& buffer, uint64_t offset, uint64_t bytes);
    OnHost(const OnHost&) = delete;
    OnHost& operator=(const OnHost&) = delete;
    std::span<std::byte> bytes() const { return bytes_; }
    /// Called before the bytes are read, and after all are written.
    void read();
    void write();

  private:
    gpu::Buffer& buffer_;
    uint64_t offset_;
    std::vector<std::byte> copy_;
    std::span<std::byte> bytes_;
};

/// What was copied to the device and back so far.
struct Streaming {
    uint64_t bytes = 0;
    double milliseconds = 0;

    /// Copies so many bytes.
    template <class Copy>
    void stream(uint64_t size, Copy copy) {
        const auto begin = std::chrono::steady_clock::now();
        copy();
        milliseconds +=
            std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
        bytes += size;
    }
};

/// What this rank's portions list of a part of a view.
struct Seen {
    // The listed splats of each portion, and the list index of the first one.
    std::vector<uint64_t> listed, first_indices;
    std::vector<std::vector<std::byte>> records;  // that wait in host memory, of each portion
    std::vector<std::byte> sums;                  // the same, of one portion after another
    uint64_t skipped = 0;                         // splats
    explicit Seen(size_t portions) : listed(portions), first_indices(portions), records(portions) {}
};

/// Parts of views that are drawn at one time: at most one by each rank. Part `first` + k is drawn by rank k.
struct Turn {
    size_t first, view_parts;
    std::vector<uint64_t> listed{};  // by this rank, of each part
    std::vector<uint64_t> of_own{};  // listed by each rank, of the part that this rank draws
    bool draws(int rank) const { return size_t(rank) < view_parts; }
    uint64_t own() const { return sum_of(of_own); }
};

/// What a step holds besides the portions.
struct StepBuffers {
    pipeline::ViewBuffers portion;  // of the portion in use
    gpu::Buffer own_sums;           // of the part that this rank draws, unless all is in one portion
    std::vector<Seen> seen;         // by part of a view
};

/// Where lists and sums wait.
class Lists {
  public:
    using Use = std::function<void(std::span<const std::span<std::byte>>)>;
    virtual ~Lists() = default;

    /// How many of all parts of views are listed before one is drawn.
    virtual size_t at_once(size_t view_parts, size_t ranks) const = 0;
    /// How many splats a frame has room for where it holds so many. largest: portion of this rank.
    virtual uint64_t room(uint64_t splats, uint64_t largest) const = 0;
    /// How many records ViewBuffers::visible has room for. splats: of a portion.
    virtual uint64_t records(uint64_t splats, uint64_t view_parts) const = 0;
    /// Takes the list that visible ends with. Returns how many of its records stay there.
    virtual uint64_t take(StepBuffers& of, Seen& seen, size_t portion) = 0;
    /// After the lists of a portion, which have so many indices; and after those of all.
    virtual void end_portion(gpu::Executor& executor, const pipeline::Plan& plan, StepBuffers& of,
                             uint64_t indices) = 0;
    virtual void end_all(StepBuffers& of) = 0;

    /// Calls `use` with the records of each rank's part of the turn.
    virtual void send(StepBuffers& of, const Turn& turn, size_t ranks, const Use& use) = 0;
    /// Calls `use` with room for the sums that come back, of `bytes` a splat.
    virtual void receive(StepBuffers& of, const Turn& turn, size_t ranks, uint64_t bytes, const Use& use) = 0;
    /// Has the sums of a portion on the device, of `bytes` a splat; after its update, returns the list indices that stay there.
    virtual void begin_update(StepBuffers& of, size_t portion, uint64_t bytes) = 0;
    virtual gpu::Buffer end_update(StepBuffers& of) = 0;
};

std::unique_ptr<Lists> lists_on_device(gpu::Device& device);
/// streaming: counts what they copy.
std::unique_ptr<Lists> lists_in_host_memory(gpu::Device& device, Streaming& streaming);

/// Makes room for so many bytes and an eighth more: the next views are of about this size.
void make_room(gpu::Device& device, gpu::Buffer& buffer, const char* name, uint64_t bytes);

}  // namespace ewa::portions
