// SPDX-License-Identifier: Apache-2.0
// Storage of a step's lists of visible splats until a part of a view is drawn from them, and of the sums of gradients until the
// update. Both are on the device or in host memory.
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

/// Divides `all` into a piece for each rank, in order: values[rank] values of `bytes` bytes. Ranks beyond `values` get empty
/// pieces.
std::vector<std::span<std::byte>> pieces_of(std::span<std::byte> all, std::span<const uint64_t> values,
                                            uint64_t bytes, size_t ranks);

/// A part of a device buffer on the host: the buffer's own memory if it is mapped, else a copy.
class OnHost {
  public:
    OnHost(gpu::Buffer& buffer, uint64_t offset, uint64_t bytes);
    OnHost(const OnHost&) = delete;
    OnHost& operator=(const OnHost&) = delete;
    std::span<std::byte> bytes() const { return bytes_; }
    /// Call read before reading bytes(), and write after writing all of them.
    void read();
    void write();

  private:
    gpu::Buffer& buffer_;
    uint64_t offset_;
    std::vector<std::byte> copy_;
    std::span<std::byte> bytes_;
};

/// Bytes that were copied to the device and back so far, and the time that this took.
struct Streaming {
    uint64_t bytes = 0;
    double milliseconds = 0;

    /// Runs `copy`, which copies `size` bytes, and counts bytes and time.
    template <class Copy>
    void stream(uint64_t size, Copy copy) {
        const auto begin = std::chrono::steady_clock::now();
        copy();
        milliseconds +=
            std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
        bytes += size;
    }
};

/// The splats of this rank's portions that a part of a view sees.
struct Seen {
    // The listed splats of each portion, and the list index of the first one.
    std::vector<uint64_t> listed, first_indices;
    std::vector<std::vector<std::byte>> records;  // of each portion, in host memory until they are drawn
    std::vector<std::byte> sums;  // of gradients, of one portion after another, in host memory
    uint64_t skipped = 0;         // splats
    explicit Seen(size_t portions) : listed(portions), first_indices(portions), records(portions) {}
};

/// Parts of views that the ranks draw at the same time, at most one for each rank. Rank k draws part `first` + k.
struct Turn {
    size_t first, view_parts;
    std::vector<uint64_t> listed{};  // number of splats that this rank lists for each part
    std::vector<uint64_t> of_own{};  // the same by each rank, for the part that this rank draws
    bool draws(int rank) const { return size_t(rank) < view_parts; }
    uint64_t own() const { return sum_of(of_own); }
};

/// The buffers of a step besides the portions.
struct StepBuffers {
    pipeline::ViewBuffers portion;  // of the portion in use
    gpu::Buffer own_sums;           // of the view part that this rank draws; empty with one portion in all
    std::vector<Seen> seen;         // by part of a view
};

/// Stores lists until they are drawn, and sums of gradients until the update: on the device or in host memory.
class Lists {
  public:
    using Use = std::function<void(std::span<const std::span<std::byte>>)>;
    virtual ~Lists() = default;

    /// The number of view parts that are listed before one of them is drawn.
    virtual size_t at_once(size_t view_parts, size_t ranks) const = 0;
    /// For how many splats a frame is allocated if it draws `splats` splats. largest: splats of this rank's largest portion.
    virtual uint64_t room(uint64_t splats, uint64_t largest) const = 0;
    /// For how many records ViewBuffers::visible is allocated. splats: of a portion.
    virtual uint64_t records(uint64_t splats, uint64_t view_parts) const = 0;
    /// Takes the last list in ViewBuffers::visible. Returns the number of its records that stay in that buffer.
    virtual uint64_t take(StepBuffers& of, Seen& seen, size_t portion) = 0;
    /// Called after a portion's lists are made, and after those of all portions. indices: number of list indices so far.
    virtual void end_portion(gpu::Executor& executor, const pipeline::Plan& plan, StepBuffers& of,
                             uint64_t indices) = 0;
    virtual void end_all(StepBuffers& of) = 0;

    /// Calls `use` with the records to send: for each rank, this rank's records of the part that it draws.
    virtual void send(StepBuffers& of, const Turn& turn, size_t ranks, const Use& use) = 0;
    /// Calls `use` with memory for the sums of gradients that each rank sends back, `bytes` bytes per splat.
    virtual void receive(StepBuffers& of, const Turn& turn, size_t ranks, uint64_t bytes, const Use& use) = 0;
    /// Brings a portion's sums to the device, `bytes` bytes per splat. After its update, end_update returns the list indices that
    /// stay there.
    virtual void begin_update(StepBuffers& of, size_t portion, uint64_t bytes) = 0;
    virtual gpu::Buffer end_update(StepBuffers& of) = 0;
};

std::unique_ptr<Lists> lists_on_device(gpu::Device& device);
/// streaming: counts the copies between device and host.
std::unique_ptr<Lists> lists_in_host_memory(gpu::Device& device, Streaming& streaming);

/// Reallocates a buffer of fewer than `bytes` bytes, with an eighth more, so that later views of about this size fit.
void make_room(gpu::Device& device, gpu::Buffer& buffer, const char* name, uint64_t bytes);

}  // namespace ewa::portions
