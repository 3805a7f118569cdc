// SPDX-License-Identifier: Apache-2.0
// Blocks of device memory: buffers share them without overlap, they stay few and full, and free ones go back.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>

#include "core/random.h"
#include "gpu/executor.h"
#include "gpu/read_back.h"
#include "gpu/test_device.h"

namespace ewa::test {
namespace {

constexpr uint64_t kMiB = uint64_t(1) << 20;

uint32_t random_word(uint32_t i) {
    return core::pcg4d({i, 0x6d656du, 0, 0})[0];
}

TEST(FreeRanges, NeverGiveAByteTwiceAndJoinAgain) {
    constexpr uint64_t kBytes = 4096;
    gpu::FreeRanges free(kBytes);
    std::map<uint64_t, uint64_t> taken;
    std::vector<bool> used(kBytes);
    for (uint32_t i = 0; i < 4000; ++i) {
        if (i % 8 < 5 || taken.empty()) {
            const uint64_t bytes = 1 + random_word(2 * i) % 300, alignment = 1u << random_word(2 * i + 1) % 8;
            const auto offset = free.take(bytes, alignment);
            if (!offset) continue;
            EXPECT_EQ(*offset % alignment, 0u);
            ASSERT_LE(*offset + bytes, kBytes);
            for (uint64_t at = *offset; at < *offset + bytes; ++at) {
                ASSERT_FALSE(used[at]);
                used[at] = true;
            }
            taken[*offset] = bytes;
        } else {
            const auto one = std::next(taken.begin(), random_word(2 * i) % taken.size());
            for (uint64_t at = one->first; at < one->first + one->second; ++at) used[at] = false;
            free.give_back(one->first, one->second);
            taken.erase(one);
        }
        EXPECT_EQ(free.all_free(), taken.empty());
    }
    EXPECT_GT(taken.size(), 5u);
    for (const auto& [offset, bytes] : taken) free.give_back(offset, bytes);
    EXPECT_TRUE(free.all_free());
    EXPECT_EQ(free.take(kBytes, 64), 0u);
    EXPECT_FALSE(free.take(1, 1));
}

TEST(BlockBytes, AreWholeBuffersAndASixteenthOfWhatThereIs) {
    const uint64_t heap = uint64_t(64) << 30;
    EXPECT_EQ(gpu::block_bytes(1024, 0, heap), kMiB);
    EXPECT_EQ(gpu::block_bytes(1000, 0, heap), 1048 * 1000);
    EXPECT_EQ(gpu::block_bytes(100 * kMiB, 0, heap), 100 * kMiB);  // a block of its own
    EXPECT_EQ(gpu::block_bytes(3 * kMiB, 160 * kMiB, heap), 9 * kMiB);
    EXPECT_EQ(gpu::block_bytes(kMiB, uint64_t(1) << 40, heap), 256 * kMiB);
    EXPECT_EQ(gpu::block_bytes(kMiB, uint64_t(1) << 40, 256 * kMiB), 4 * kMiB);  // a small heap
}

std::vector<uint32_t> contents(uint32_t i) {
    return {i, random_word(i), ~i, 1};
}

TEST(DeviceMemory, ThousandsOfBuffersShareAFewBlocks) {
    const auto own = open_test_device(true);
    const gpu::MemoryUse before = own->memory_use();
    std::vector<gpu::Buffer> buffers;
    for (uint32_t i = 0; i < 5000; ++i) {
        const uint64_t bytes = 16 + random_word(i) % 40000;
        buffers.emplace_back(*own, "image", bytes, i % 2 ? gpu::Texel::rgba8 : gpu::Texel::none);
    }
    // Their ends, where a neighbour would be.
    const auto last = [](const gpu::Buffer& buffer) { return buffer.bytes() - 16; };
    for (uint32_t i = 0; i < buffers.size(); ++i)
        buffers[i].upload(std::span<const uint32_t>(contents(i)), last(buffers[i]));
    const gpu::MemoryUse full = own->memory_use();
    printf("    %u blocks, %.1f MiB for %.1f MiB\n", full.blocks, double(full.held) / double(kMiB),
           double(full.used) / double(kMiB));
    EXPECT_LT(full.allocated - before.allocated, 100u);
    EXPECT_LT(double(full.held), 1.08 * double(full.used) + double(kMiB));
    uint64_t bytes = before.used;
    for (const gpu::Buffer& buffer : buffers) bytes += buffer.bytes();
    EXPECT_EQ(own->allocated_bytes(), full.used);
    EXPECT_NEAR(double(full.used), double(bytes), 0.01 * double(bytes));
    for (uint32_t i = 0; i < buffers.size(); ++i)
        ASSERT_EQ(buffers[i].download<uint32_t>(4, last(buffers[i])), contents(i)) << i;

    // What one frees, the next takes: no block is new.
    for (uint32_t i = 0; i < buffers.size(); i += 2) buffers[i] = {};
    for (uint32_t i = 0; i < buffers.size(); i += 2) buffers[i] = gpu::Buffer(*own, "image", 16);
    EXPECT_EQ(own->memory_use().allocated, full.allocated);
    for (uint32_t i = 1; i < buffers.size(); i += 2)
        ASSERT_EQ(buffers[i].download<uint32_t>(4, last(buffers[i])), contents(i)) << i;
    buffers.clear();
    const gpu::MemoryUse after = own->memory_use();
    EXPECT_EQ(after.used, before.used);
    EXPECT_EQ(after.held, before.held);
    EXPECT_EQ(after.blocks, before.blocks);
    EXPECT_GE(after.peak, full.used);  // staging copies are small
    EXPECT_LT(after.peak, full.used + kMiB);
}

TEST(DeviceMemory, ALargeBufferTakesAndFreesItsOwnBytes) {
    const auto own = open_test_device(true);
    const gpu::Buffer little(*own, "little", 100);
    const gpu::MemoryUse before = own->memory_use();
    {
        gpu::Buffer large(*own, "large", 5 * kMiB);
        const gpu::MemoryUse held = own->memory_use();
        EXPECT_EQ(held.blocks, before.blocks + 1);
        EXPECT_LT(held.held - before.held, 5 * kMiB + 4096);
        const gpu::Buffer moved = std::move(large);
        EXPECT_FALSE(large.mapped());
        EXPECT_EQ(own->memory_use().used, held.used);
    }
    EXPECT_EQ(own->memory_use().held, before.held);
}

/// An allocation of the driver would cost more than the copy.
TEST(DeviceMemory, CopiesShareOneStagingBlock) {
    const auto own = open_test_device(true);
    own->limit_host_access(gpu::HostAccess::none);
    gpu::Buffer large(*own, "large", 5 * kMiB);  // leaves no room in its block
    const gpu::MemoryUse before = own->memory_use();
    for (uint32_t i = 0; i < 20; ++i) {
        large.upload(std::span<const uint32_t>(contents(i)), 16 * i);
        EXPECT_EQ(large.download<uint32_t>(4, 16 * i), contents(i));
        EXPECT_EQ(own->memory_use().held, before.held);
        EXPECT_EQ(own->memory_use().blocks, before.blocks);
    }
    EXPECT_EQ(own->memory_use().allocated, before.allocated + 1);

    // A larger copy needs a block of its own, which the next ones take.
    const std::vector<uint32_t> words(kMiB, 7);
    for (int i = 0; i < 3; ++i) large.upload(std::span<const uint32_t>(words));
    large.upload(std::span<const uint32_t>(contents(1)));
    EXPECT_EQ(own->memory_use().allocated, before.allocated + 2);
    EXPECT_EQ(large.download<uint32_t>(2, 16), std::vector<uint32_t>(2, 7));
    EXPECT_EQ(own->memory_use().held, before.held);
}

/// The spare block counts within a limit: it makes room for others.
TEST(DeviceMemory, ASpareStagingBlockMakesRoom) {
    const auto own = open_test_device(true);
    own->limit_host_access(gpu::HostAccess::none);
    own->limit_memory(64 * kMiB, {});
    gpu::Buffer large(*own, "large", 40 * kMiB);
    const std::vector<uint32_t> words(kMiB / 4, 7);
    large.upload(std::span<const uint32_t>(words));
    const gpu::MemoryUse spare = own->memory_use();
    // 62 MiB are for buffers of the device: the spare block's mebibyte is part of them.
    const gpu::Buffer rest(*own, "rest", 22 * kMiB - 65536);
    EXPECT_LE(own->memory_use().held, 62 * kMiB);
    large.upload(std::span<const uint32_t>(words));
    EXPECT_EQ(own->memory_use().allocated, spare.allocated + 2);
    EXPECT_EQ(large.download<uint32_t>(2), std::vector<uint32_t>(2, 7));
}

/// Counts of kernels: the host reads them at the end of a submission, whatever it can map.
TEST(ReadBack, GivesTheValueOfTheLastSubmission) {
    for (const auto most : {gpu::HostAccess::none, gpu::HostAccess::write, gpu::HostAccess::read_write}) {
        const auto own = open_test_device(true);
        own->limit_host_access(most);
        const gpu::ReadBack<uint32_t> value(*own, "value");
        gpu::Executor executor(*own);
        for (const uint32_t expected : {7u, 0u, 9u}) {
            gpu::Recording recording(own->limits());
            value.clear(recording);
            if (expected) recording.fill(value.buffer(), expected, 0, 4);
            value.record(recording);
            executor.run(recording);
            EXPECT_EQ(value.read(), expected);
        }
    }
}

/// The device reads and writes an array of the host where it is, and takes no memory of its own.
TEST(HostMemory, IsReadAndWrittenInPlace) {
    const auto own = open_test_device(true);
    if (own->limits().host_page == 0) GTEST_SKIP() << "this device cannot use pages of the host";
    std::vector<uint32_t> values(100003);
    std::iota(values.begin(), values.end(), 5u);
    // Words in front of the array and behind it belong to others.
    const size_t first = 4 - reinterpret_cast<uintptr_t>(values.data()) / 4 % 4 + 8;
    const std::span<uint32_t> part(&values[first], 100000 - first);
    const uint64_t before = own->memory_use().allocated;
    {
        const auto lent = gpu::Buffer::in_host_memory(*own, "lent", std::as_bytes(part));
        ASSERT_TRUE(lent);
        EXPECT_EQ(own->memory_use().allocated, before);
        gpu::Buffer copy(*own, "copy", part.size_bytes());
        gpu::Executor executor(*own);
        gpu::Recording recording(own->limits());
        recording.copy(*lent, 0, copy, 0, part.size_bytes());
        recording.fill(*lent, 77, 0, 16);
        executor.run(recording);
        const auto read = copy.download<uint32_t>(part.size());
        for (size_t i = 0; i < read.size(); ++i) ASSERT_EQ(read[i], uint32_t(first + i + 5)) << i;
        EXPECT_EQ(part[0], 77u);
        EXPECT_EQ(part[4], uint32_t(first + 9));
        EXPECT_EQ(values[first - 1], uint32_t(first + 4));
    }
    EXPECT_EQ(values[99999], 100004u);
}

TEST(HostMemory, OfAnOddAddressIsRefused) {
    const auto own = open_test_device(true);
    const std::vector<uint32_t> values(2048);  // its address is a multiple of 16
    EXPECT_FALSE(gpu::Buffer::in_host_memory(*own, "odd", std::as_bytes(std::span(values)).subspan(4)));
    EXPECT_FALSE(gpu::Buffer::in_host_memory(*own, "none", {}));
}

}  // namespace
}  // namespace ewa::test
