// SPDX-License-Identifier: Apache-2.0
// Buffers with guard words behind the last byte a pass may touch, and poison in front of them: a write past
// the end leaves a trace even where the result is right, and a value no pass wrote is a NaN.
#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gpu/buffer.h"
#include "gpu/executor.h"
#include "gpu/test_device.h"
#include "passes/pass.h"
#include "pipeline/frame_buffers.h"

namespace ewa::test {

inline constexpr uint64_t kGuardWords = 64;
inline constexpr uint32_t kPoison = 0x7fc0beefu;  // a NaN as a float, a large number as an index
inline uint32_t guard_word(uint64_t i) {
    return 0x5eed0000u + uint32_t(i);
}

/// Writes guard words behind byte `used` (a multiple of 4) of a buffer that has room for them.
inline void set_guard(gpu::Buffer& buffer, uint64_t used) {
    std::vector<uint32_t> words(kGuardWords);
    for (uint64_t i = 0; i < kGuardWords; ++i) words[i] = guard_word(i);
    buffer.upload(std::span<const uint32_t>(words), used);
}

inline testing::AssertionResult guard_is_intact(const gpu::Buffer& buffer, uint64_t used) {
    const auto words = buffer.download<uint32_t>(kGuardWords, used);
    for (uint64_t i = 0; i < kGuardWords; ++i)
        if (words[i] != guard_word(i))
            return testing::AssertionFailure() << buffer.name() << ": word " << i << " behind its " << used
                                               << " bytes was overwritten with " << words[i];
    return testing::AssertionSuccess();
}

class Guarded {
  public:
    Guarded(const char* name, uint64_t bytes, gpu::Texel texel = gpu::Texel::none)
        : used_((bytes + 3) / 4 * 4), buffer_(*device(), name, used_ + 4 * kGuardWords, texel) {
        buffer_.upload(std::span<const uint32_t>(std::vector<uint32_t>(used_ / 4, kPoison)));
        set_guard(buffer_, used_);
    }
    template <class T>
    Guarded(const char* name, const std::vector<T>& data, gpu::Texel texel = gpu::Texel::none)
        : Guarded(name, data.size() * sizeof(T), texel) {
        buffer_.upload(std::span<const T>(data));
    }
    operator const gpu::Buffer&() const { return buffer_; }
    operator gpu::BufferPart() const { return buffer_; }
    const gpu::Buffer& buffer() const { return buffer_; }
    template <class T>
    std::vector<T> read() const {
        return buffer_.download<T>(used_ / sizeof(T));
    }
    testing::AssertionResult intact() const { return guard_is_intact(buffer_, used_); }

  private:
    uint64_t used_;
    gpu::Buffer buffer_;
};

inline void expect_intact(std::initializer_list<const Guarded*> buffers) {
    for (const Guarded* buffer : buffers) EXPECT_TRUE(buffer->intact());
}

/// All buffers of a frame, guarded. FrameBuffers::reserve keeps buffers that are large enough, so the frame
/// uses these.
class GuardedFrame {
  public:
    GuardedFrame(const passes::KernelConfig& shape, const pipeline::FrameRequest& request) {
        const pipeline::Sizes s = sizes_for(shape, request);
        using gpu::Texel;
        make(frame.counts, "counts", sizeof(shared::Counts), Texel::none, true);
        make(frame.records, "records", s.records, Texel::rgba32f);
        for (auto* pair : {&frame.depth_keys, &frame.order})
            for (auto& buffer : *pair) make(buffer, "splat words", s.splat_words, Texel::rgba32ui);
        make(frame.tile_counts, "tile counts", s.splat_words);
        make(frame.prefix, "prefix", s.splat_words);
        make(frame.scan_totals, "scan totals", s.scan_totals);
        make(frame.first_instances, "first instances", request.gradients ? s.splat_words : 16);
        make(frame.counters, "counters", s.counters);
        make(frame.lists, "lists", s.lists);
        make(frame.counter_prefix, "counter prefix", s.counters);
        make(frame.digit_totals, "digit totals", s.digit_totals);
        for (auto* pair : {&frame.instance_keys, &frame.instance_splats})
            for (auto& buffer : *pair) make(buffer, "instance words", s.instance_words, Texel::rgba32ui);
        make(frame.tile_starts, "tile starts", s.tile_starts);
        make(frame.planes, "planes", s.planes, Texel::rgba32f);
        if (request.gradients) {
            make(frame.target, "target", s.target, Texel::rgba32f);
            if (request.appearance != AppearanceModel::none) {
                make(frame.exposed, "exposed", s.exposed, Texel::rgba32f);
                make(frame.appearance_sums, "appearance sums", s.appearance_sums);
            }
            if (request.motion) {
                make(frame.motion_sums, "motion sums", s.motion_sums);
                make(frame.motion_reduced, "motion reduced", s.motion_reduced);
            }
            if (request.masks) make(frame.masked, "masked", s.masked, Texel::rgba32f);
            make(frame.moments, "moments", s.moments, Texel::rgba32f);
            make(frame.derivatives, "derivatives", s.derivatives, Texel::rgba32f);
            make(frame.blurred, "blurred", s.derivatives, Texel::rgba32f);
            make(frame.image_gradient, "image gradient", s.image_gradient, Texel::rgba32f);
            make(frame.partials, "partials", s.partial_sums);
            make(frame.reduced, "reduced", s.reduced);
            for (auto& buffer : frame.sorted_indices)
                make(buffer, "sorted indices", s.instance_words, Texel::rgba32ui);
            make(frame.slots, "slots", s.slots, Texel::rgba32f);
        }
        frame.reserve(*device(), shape, request);  // zeroes planes and target, guards included
        for (const auto& [buffer, used] : buffers_) set_guard(*buffer, used);
    }
    GuardedFrame(const GuardedFrame&) = delete;

    testing::AssertionResult intact() const {
        for (const auto& [buffer, used] : buffers_)
            if (auto result = guard_is_intact(*buffer, used); !result) return result;
        return testing::AssertionSuccess();
    }
    pipeline::FrameBuffers frame;

  private:
    void make(gpu::Buffer& buffer, const char* name, uint64_t used, gpu::Texel texel = gpu::Texel::none,
              bool host_visible = false) {
        buffer = gpu::Buffer(*device(), name, used + 4 * kGuardWords, texel, false, host_visible);
        buffer.upload(std::span<const uint32_t>(std::vector<uint32_t>(used / 4, kPoison)));
        buffers_.push_back({&buffer, used});
    }
    std::vector<std::pair<gpu::Buffer*, uint64_t>> buffers_;
};

/// Passes and an executor on the test device, shared by the tests of a process.
struct Rig {
    passes::PassCache cache{*device()};
    gpu::Executor executor{*device()};

    const passes::KernelConfig& config() const { return cache.config(); }
    gpu::Recording recording() const { return gpu::Recording(device()->limits()); }
    /// Runs what `record` puts into a recording.
    template <class Record>
    void run(Record record) {
        gpu::Recording commands = recording();
        record(commands);
        executor.run(commands);
    }
};
inline SharedByTests<Rig>* const rig_of_all = SharedByTests<Rig>::add();
inline Rig& rig() {
    return rig_of_all->get([] { return Rig(); });
}

inline Guarded zero_counts() {
    return Guarded("counts", std::vector<shared::Counts>(1));
}

}  // namespace ewa::test
