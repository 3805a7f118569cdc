// SPDX-License-Identifier: Apache-2.0
// Prefix sums and the radix sort on the device: both are exact.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "gpu/guarded.h"
#include "pipeline/sorting.h"
#include "reference/blend.h"
#include "support/random_scene.h"

namespace ewa::test {
namespace {

using pipeline::RadixCut;

class Scan : public testing::TestWithParam<std::pair<uint32_t, uint32_t>> {};

TEST_P(Scan, IsTheExclusivePrefixSum) {
    const uint32_t items = GetParam().first, block = GetParam().second;
    Rig& r = rig();
    Random random(items + block);
    for (const bool gathered : {false, true}) {
        std::vector<uint32_t> source(std::max(items, 1u)), order(source.size());
        for (auto& value : source) value = uint32_t(random.bits() % 1000);
        std::iota(order.begin(), order.end(), 0u);
        for (size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.bits() % i]);
        const uint32_t blocks = (items + block - 1) / block;
        Guarded values("source", source), ranks("order", order), prefix("prefix", source.size() * 4),
            totals("totals", (blocks + 1) * 4), counts = zero_counts();
        r.run([&](gpu::Recording& recording) {
            pipeline::record_scan(
                {recording, r.cache}, {values, gathered ? &ranks.buffer() : nullptr, prefix, totals, counts},
                {items, block, gathered ? shared::TOTAL_INSTANCES : shared::TOTAL_SCAN, "scan"});
        });
        const auto within = prefix.read<uint32_t>(), before = totals.read<uint32_t>();
        uint32_t sum = 0;
        for (uint32_t e = 0; e < items; ++e) {
            ASSERT_EQ(before[e / block] + within[e], sum) << "entry " << e;
            sum += source[gathered ? order[e] : e];
        }
        EXPECT_EQ(before[blocks], sum);
        const auto read = counts.read<shared::Counts>()[0];
        EXPECT_EQ(gathered ? read.instances : read.scan_total, sum);
        EXPECT_EQ(gathered ? read.scan_total : read.instances, 0u);
        expect_intact({&values, &prefix, &totals, &counts});
    }
}

INSTANTIATE_TEST_SUITE_P(Sizes, Scan,
                         testing::Values(std::pair{0u, 64u}, std::pair{1u, 64u}, std::pair{63u, 64u},
                                         std::pair{64u, 64u}, std::pair{65u, 64u}, std::pair{1000u, 7u},
                                         std::pair{100003u, 512u}, std::pair{70001u, 1u}));

struct Sorted {
    std::vector<uint32_t> values, keys, places;
};

/// device_count: the number of items is left for the device to read from Counts.instances.
Sorted run_sort(const std::vector<uint32_t>& input, const RadixCut& cut, bool own_numbers, bool keep_keys,
                bool device_count, uint32_t capacity, const std::vector<uint32_t>& first_values = {}) {
    Rig& r = rig();
    const uint32_t items = uint32_t(input.size());
    const uint64_t bytes = std::max(items, 1u) * 4;
    std::vector<uint32_t> padded = input;
    padded.resize(std::max(items, 1u));
    using gpu::Texel;
    Guarded keys0("keys 0", padded, Texel::rgba32ui), keys1("keys 1", bytes, Texel::rgba32ui),
        values0("values 0", own_numbers ? std::vector<uint32_t>(padded.size(), kPoison) : first_values,
                Texel::rgba32ui),
        values1("values 1", bytes, Texel::rgba32ui), places0("places 0", bytes, Texel::rgba32ui),
        places1("places 1", bytes, Texel::rgba32ui),
        counters("counters", (uint64_t(cut.lanes) << cut.bits) * 4),
        prefix("counter prefix", (uint64_t(cut.lanes) << cut.bits) * 4),
        totals("digit totals", ((uint64_t(1) << cut.bits) + 1) * 4);
    shared::Counts start{};
    start.instances = items;
    Guarded counts("counts", std::vector<shared::Counts>{start});
    uint32_t result = 0;
    r.run([&](gpu::Recording& recording) {
        result = pipeline::record_sort(
            {recording, r.cache},
            {{&keys0.buffer(), &keys1.buffer()},
             {&values0.buffer(), &values1.buffer()},
             {own_numbers ? nullptr : &places0.buffer(), own_numbers ? nullptr : &places1.buffer()},
             own_numbers,
             counters,
             prefix,
             totals,
             counts},
            {cut, device_count ? 0 : items, capacity, keep_keys, "sort"});
    });
    expect_intact({&keys0, &keys1, &values0, &values1, &places0, &places1, &counters, &prefix, &totals});
    Sorted out{(result ? values1 : values0).read<uint32_t>(), (result ? keys1 : keys0).read<uint32_t>(),
               (result ? places1 : places0).read<uint32_t>()};
    out.places.resize(items);
    out.values.resize(items);
    out.keys.resize(items);
    return out;
}

RadixCut cut_for(uint32_t items, uint32_t bits) {
    return pipeline::radix_cut(rig().config(), items, bits);
}

class Sort : public testing::TestWithParam<uint32_t> {};

TEST_P(Sort, IsStableForEveryKeyWidth) {
    const uint32_t items = GetParam();
    Random random(items);
    for (const uint32_t bits : {1u, 3u, 8u, 9u, 13u, 16u, 17u, 24u, 31u, 32u}) {
        if (items > 10000 && bits != 13 && bits != 32) continue;  // the loop's time
        std::vector<uint32_t> keys(items);
        for (auto& key : keys) {
            // A quarter of the keys repeat, and both ends of the range occur.
            const uint64_t draw = random.bits();
            key = uint32_t(draw % 4 ? draw >> 32 : draw % 1024 ? 5 : 0xffffffffu);
            if (draw % 97 == 0) key = 0xffffffffu;
            if (bits < 32) key &= (1u << bits) - 1;
        }
        const Sorted sorted = run_sort(keys, cut_for(items, bits), true, true, false, items);
        const auto expected = reference::stable_order<uint32_t>(keys);
        ASSERT_EQ(sorted.values, expected) << bits << " bits";
        for (uint32_t i = 0; i < items; ++i) ASSERT_EQ(sorted.keys[i], keys[expected[i]]) << bits << " bits";
    }
}

TEST_P(Sort, CarriesValuesTellsPlacesAndReadsTheNumberOfItemsOnTheDevice) {
    const uint32_t items = GetParam();
    Random random(items + 1);
    std::vector<uint32_t> keys(items), values(std::max(items, 1u));
    for (auto& key : keys) key = uint32_t(random.bits() % 300);
    for (auto& value : values) value = uint32_t(random.bits());
    const Sorted sorted = run_sort(keys, cut_for(items, 9), false, false, true, items, values);
    const auto order = reference::stable_order<uint32_t>(keys);
    std::vector<uint32_t> expected;
    for (const uint32_t i : order) expected.push_back(values[i]);
    EXPECT_EQ(sorted.values, expected);
    for (uint32_t place = 0; place < items; ++place) ASSERT_EQ(sorted.places[order[place]], place);
}

TEST(SortEdges, ManyItemsWithKeysOf15BitsTakeOnePass) {
    if (rig().config().ranked_sort) GTEST_SKIP() << "the device ranks keys in shared memory";
    const uint32_t items = rig().config().sort_lanes_max << 13;
    if (items > 1u << 21) GTEST_SKIP() << "too many lanes for a short test";
    Random random(15);
    std::vector<uint32_t> keys(items);
    for (auto& key : keys) key = uint32_t(random.bits() & 0x7fff);
    const RadixCut cut = cut_for(items, 15);
    EXPECT_EQ(cut.passes, 1u);
    const Sorted sorted = run_sort(keys, cut, true, false, false, items);
    EXPECT_EQ(sorted.values, reference::stable_order<uint32_t>(keys));
}

INSTANTIATE_TEST_SUITE_P(Sizes, Sort, testing::Values(0u, 1u, 7u, 1000u, 100003u));

TEST(SortEdges, MoreItemsThanRoomSortsNothing) {
    std::vector<uint32_t> keys(1000);
    for (uint32_t i = 0; i < 1000; ++i) keys[i] = 999 - i;
    const Sorted sorted = run_sort(keys, cut_for(1000, 10), true, true, true, 999);
    for (const uint32_t value : sorted.values) EXPECT_EQ(value, kPoison);
}

TEST(SortEdges, EqualKeysKeepTheirOrderAndAFewLanesAreEnough) {
    const std::vector<uint32_t> keys(5000, 0x80000001u);
    RadixCut cut = cut_for(5000, 32);
    for (const uint32_t lanes : {1u, 3u, 511u}) {
        if (rig().config().ranked_sort && lanes < cut.lanes) continue;
        cut.lanes = lanes;
        std::vector<uint32_t> expected(5000);
        std::iota(expected.begin(), expected.end(), 0u);
        EXPECT_EQ(run_sort(keys, cut, true, true, false, 5000).values, expected) << lanes << " lanes";
    }
}

/// Keys that nobody reads again are not written: the last of one pass leaves its output alone.
TEST(SortEdges, KeysAreDroppedWhereNobodyReadsThem) {
    const std::vector<uint32_t> keys{5, 3, 9, 1, 7};
    for (const uint32_t key : run_sort(keys, cut_for(5, 8), true, false, false, 5).keys)
        EXPECT_EQ(key, kPoison);
    EXPECT_EQ(run_sort(keys, cut_for(5, 8), true, true, false, 5).keys,
              (std::vector<uint32_t>{1, 3, 5, 7, 9}));
}

/// Depths are sorted by their bits: for positive floats that is their order.
TEST(SortEdges, PositiveFloatsSortByTheirBits) {
    Random random(5);
    std::vector<float> depths(3000);
    std::vector<uint32_t> keys;
    for (float& depth : depths) {
        depth = float(std::exp(random.uniform(-40, 40)));
        keys.push_back(std::bit_cast<uint32_t>(depth));
    }
    EXPECT_EQ(run_sort(keys, cut_for(3000, 32), true, false, false, 3000).values,
              reference::stable_order<float>(depths));
}

}  // namespace
}  // namespace ewa::test
