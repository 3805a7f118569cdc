// SPDX-License-Identifier: Apache-2.0
// The splats of a training in chunks, which are divided as among ranks. The host holds all of them, and the device as many as
// fit in its limit. Steps visit the chunks forwards and backwards in turn, so the last ones of a visit are the first ones of
// the next.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "ewa/ranks.h"
#include "pipeline/model.h"

namespace ewa::train {

class Chunks {
  public:
    /// What a chunk has on the device while it is used.
    enum class Need { params, state };

    /// count: of chunks. Limits the device's memory to `limit` bytes as long as this lives.
    Chunks(gpu::Device& device, int count, uint64_t limit);
    ~Chunks();
    Chunks(const Chunks&) = delete;
    Chunks& operator=(const Chunks&) = delete;

    int count() const { return int(chunks_.size()); }
    uint32_t largest() const;  // splats of a chunk
    /// Gives a chunk its splats. share: which they are.
    void set(int chunk, pipeline::Model model);
    enum Array : size_t { params, moments1, moments2, statistics, places, arrays };
    /// Gives a chunk without arrays the bytes of one.
    void give(int chunk, Array array, gpu::Texel texel, std::span<const std::byte> bytes);

    /// The chunk with the arrays that are needed. They stay until another chunk is used.
    pipeline::Model& use(int chunk, Need need);
    /// The state of the chunk in use has changed in place.
    void changed();
    /// Which splat of each view is listed where (ViewBuffers::places): with the chunk from a list to its update.
    gpu::Buffer take_places();
    void keep_places(gpu::Buffer listed);

    /// Calls visit(chunk) for all, in the direction that finds most of them on the device.
    void visit(Need need, const std::function<void(int, pipeline::Model&)>& visit);

    /// Calls work for all chunks as if each were a rank. One works at a time: until it waits for the others.
    void together(const std::function<void(pipeline::Model&)>& work);

    /// The first `bytes_of(splats)` bytes of an array of each chunk, one after another.
    std::vector<std::byte> joined(Array array, const std::function<uint64_t(uint32_t)>& bytes_of);

    /// Bytes that were copied to the device and back so far.
    uint64_t streamed_bytes() const { return streamed_; }
    double streaming() const { return streaming_; }  // ms
    /// Copies so many bytes.
    template <class Copy>
    void stream(uint64_t bytes, Copy copy) {
        const auto begin = std::chrono::steady_clock::now();
        copy();
        streaming_ +=
            std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
        streamed_ += bytes;
    }

  private:
    class Member;
    struct Meeting;
    /// An array's bytes on the host, and which buffer has the same bytes.
    struct Kept {
        std::string name;
        gpu::Texel texel = gpu::Texel::none;
        std::vector<std::byte> bytes;
        uint64_t same_as = 0;  // Buffer::serial; 0: none
    };
    struct Chunk {
        pipeline::Model model;
        gpu::Buffer places;
        std::array<Kept, arrays> kept;
        gpu::Buffer& buffer(size_t array);
    };
    using Present = std::array<bool, arrays>;
    Present present(int chunk);
    void bring(int chunk, const Present& wanted);
    void copy_to_host(Chunk& chunk, size_t array);
    bool evict();
    int visits_until(int chunk, size_t array) const;

    gpu::Device& device_;
    std::vector<Chunk> chunks_;
    int in_use_ = -1;
    bool forwards_ = true;
    Need need_ = Need::state;  // of the visit
    bool evicting_ = false;
    uint64_t streamed_ = 0;
    double streaming_ = 0;
};

}  // namespace ewa::train
