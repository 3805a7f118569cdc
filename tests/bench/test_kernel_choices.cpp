// SPDX-License-Identifier: Apache-2.0
#include "bench/kernel_choices.h"

#include <gtest/gtest.h>

#include "ewa/error.h"

namespace ewa::test {
namespace {

gpu::Limits limits_of(uint32_t lanes) {
    gpu::Limits limits;
    limits.subgroup_size = lanes;
    limits.max_invocations = 1024;
    limits.shared_bytes = 49152;
    limits.ballots = true;
    return limits;
}

TEST(BenchKernels, ReplaceWhatTheDeviceGets) {
    const gpu::Limits limits = limits_of(32);
    const passes::KernelConfig own = bench::config_with("", limits);
    EXPECT_EQ(own.tile_width, passes::config_for(limits).tile_width);
    EXPECT_TRUE(own.ranked_sort);
    const passes::KernelConfig config = bench::config_with(
        "tile=8x16,broadcast=uniform,sort=counted,scan=7,elements=256,interleave=3", limits);
    EXPECT_EQ(config.tile_width, 8u);
    EXPECT_EQ(config.tile_height, 16u);
    EXPECT_EQ(config.broadcast, shared::BROADCAST_UNIFORM);
    EXPECT_FALSE(config.ranked_sort);
    EXPECT_EQ(config.scan_turns, 7u);
    EXPECT_EQ(config.element_group, 256u);
    EXPECT_EQ(config.tile_interleave, 3u);
    EXPECT_EQ(bench::config_with("tile=4x8", limits_of(4)).tile_width, 4u);
    EXPECT_EQ(own.quads, 0u);
    EXPECT_EQ(own.slots, shared::SLOTS_SORTED);
    const passes::KernelConfig quads = bench::config_with("tile=8x8,quads=96,slots=emitted", limits);
    EXPECT_EQ(quads.quads, 96u);
    EXPECT_EQ(quads.slots, shared::SLOTS_EMITTED);
    EXPECT_EQ(own.sorted_lists, 0u);
    EXPECT_EQ(bench::config_with("order=lists", limits).sorted_lists, passes::most_sorted_lists(limits));
    EXPECT_EQ(bench::config_with("order=splats", limits).sorted_lists, 0u);
}

TEST(BenchKernels, NamesWhatItCannotUse) {
    const auto message = [](const std::string& text, uint32_t lanes = 32, bool ballots = true) {
        gpu::Limits limits = limits_of(lanes);
        limits.ballots = ballots;
        try {
            bench::config_with(text, limits);
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    for (const char* wrong :
         {"tile=8", "tile=3x8", "tile=32x32", "tiles=8x8", "elements=48", "quads=48", "quads=160"}) {
        const std::string text = message(std::string("interleave=2,") + wrong);
        EXPECT_TRUE(text.starts_with("--kernels: '" + std::string(wrong) + "' is not "))
            << wrong << ": " << text;
        EXPECT_EQ(text.find('\n'), std::string::npos);
    }
    for (const char* wrong : {"tile=axb", "tile=0x8", "tile=64x8", "scan", "scan=0", "scan=1025",
                              "elements=2048", "broadcast=", "sort=fast", "slots=any", "order=any"}) {
        const std::string text = message(std::string("interleave=2,") + wrong);
        EXPECT_TRUE(text.starts_with("--kernels: " + std::string(wrong) + ": '")) << wrong << ": " << text;
        EXPECT_NE(text.find("' is not "), std::string::npos) << text;
    }
    EXPECT_NE(message("tile=16x8", 8), "");
    EXPECT_NE(message("sort=ranked", 32, false), "");
    EXPECT_EQ(message("sort=ranked"), "");
    EXPECT_EQ(message("quads=128"), "");
    EXPECT_EQ(message("quads=128", 64), "");
    EXPECT_NE(message("quads=256", 64), "") << "more than shared memory holds";
}

}  // namespace
}  // namespace ewa::test
