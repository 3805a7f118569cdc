// SPDX-License-Identifier: Apache-2.0
// Submissions: recordings that are kept and submitted again, and workgroups that the device reads.
#include <gtest/gtest.h>

#include <array>
#include <stdexcept>

#include "gpu/guarded.h"
#include "passes/passes.h"

namespace ewa::test {
namespace {

constexpr uint32_t kExecutorWords = 4;

gpu::Buffer word_buffer(const char* name, uint64_t count = kExecutorWords) {
    return gpu::Buffer(*device(), name, 4 * count);
}

gpu::Recording writing_words(const gpu::Buffer& target, const std::array<uint32_t, kExecutorWords>& values) {
    gpu::Recording recording = rig().recording();
    recording.write(target, 0, std::as_bytes(std::span(values)));
    return recording;
}

TEST(Executor, SubmitsAKeptRecordingAgain) {
    const gpu::Buffer source = word_buffer("source"), target = word_buffer("target");
    gpu::Executor executor(*device());
    gpu::Recording kept = rig().recording();
    kept.copy(source, 0, target, 0, 4 * kExecutorWords);
    executor.keep(0, kept, true);
    for (uint32_t step = 1; step <= 3; ++step) {
        executor.submit(writing_words(source, {step, 2, 3, 4}), 0, true);
        executor.wait();
        EXPECT_EQ(target.download<uint32_t>(kExecutorWords), (std::vector<uint32_t>{step, 2, 3, 4}));
        if (!device()->limits().timestamps) continue;
        ASSERT_EQ(executor.timings().size(), 2u);
        EXPECT_EQ(executor.timings()[0].pass, "write source");
        EXPECT_EQ(executor.timings()[1].pass, "copy source");
    }
    // Another recording in its place.
    gpu::Recording other = rig().recording();
    other.copy(source, 4, target, 0, 4);
    executor.keep(0, other);
    executor.submit(writing_words(source, {5, 6, 7, 8}), 0, false);
    executor.wait();
    EXPECT_EQ(target.download<uint32_t>(kExecutorWords), (std::vector<uint32_t>{6, 2, 3, 4}));
}

TEST(Executor, RefusesAKeptRecordingThatIsInUse) {
    const gpu::Buffer source = word_buffer("source"), target = word_buffer("target");
    gpu::Executor executor(*device(), 3);
    gpu::Recording kept = rig().recording();
    kept.copy(source, 0, target, 0, 4 * kExecutorWords);
    executor.keep(1, kept);
    executor.keep(0, kept);
    const gpu::Recording first = writing_words(source, {1, 2, 3, 4});
    executor.submit(first, 0, false);
    EXPECT_THROW(executor.keep(0, kept), std::logic_error);
    EXPECT_THROW(executor.submit(first, 0, false), std::logic_error);
    executor.submit(first, 1, false);
    executor.wait();  // for the first
    executor.keep(0, kept);
    EXPECT_THROW(executor.keep(1, kept), std::logic_error);
    executor.submit(first, 0, false);
    while (executor.unfinished()) executor.wait();
    EXPECT_EQ(target.download<uint32_t>(kExecutorWords), (std::vector<uint32_t>{1, 2, 3, 4}));
}

/// tile_starts writes a word for each invocation.
TEST(Executor, DispatchesTheWorkgroupsInABuffer) {
    const uint32_t group = rig().config().element_group, all = 4 * group;
    const gpu::Buffer keys = word_buffer("keys"), groups = word_buffer("groups");
    const Guarded counts = zero_counts();
    Guarded starts("starts", std::vector<uint32_t>(all, 7));
    gpu::Executor executor(*device());
    gpu::Recording kept = rig().recording();
    kept.fill(starts.buffer(), 7, 0, 4 * all);
    rig().cache.get<passes::TileStarts>().record(
        kept, {.keys = keys, .counts = counts.buffer(), .tile_starts = starts.buffer()}, {all, 1},
        gpu::Workgroups(gpu::BufferPart(groups, 4, 12)));
    executor.keep(0, kept);
    for (const uint32_t count : {2u, 0u, 3u}) {
        executor.submit(writing_words(groups, {99, count, 1, 1}), 0, false);
        executor.wait();
        std::vector<uint32_t> expected(all, 7);
        std::fill_n(expected.begin(), count * group, 0u);
        EXPECT_EQ(starts.read<uint32_t>(), expected) << count << " workgroups";
        EXPECT_TRUE(starts.intact());
    }
}

}  // namespace
}  // namespace ewa::test
