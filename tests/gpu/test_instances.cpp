// SPDX-License-Identifier: Apache-2.0
// Emission of (splat, tile) instances, and where each tile's begin, on inputs from the CPU reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "passes/passes.h"
#include "pipeline/frame_buffers.h"

namespace ewa::test {
namespace {

struct Emitted {
    std::vector<uint32_t> keys, splats, first;
};

/// Runs the pass on the CPU reference's records and order. counts: the tiles each splat is said to reach.
Emitted run_emit(const Scene& scene, const reference::Rendered& cpu, const std::vector<uint32_t>& counts,
                 bool with_first, uint32_t capacity, uint32_t strip_rows) {
    Rig& r = rig();
    const uint32_t splats = uint32_t(counts.size()), block = 100;
    std::vector<uint32_t> order = cpu.order;
    for (uint32_t i = 0; i < splats; ++i)
        if (!cpu.projected[i].visible) order.push_back(i);
    std::vector<uint32_t> prefix(splats), totals(splats / block + 2);
    uint32_t sum = 0;
    for (uint32_t rank = 0; rank < splats; ++rank) {
        if (rank % block == 0) totals[rank / block] = sum;
        prefix[rank] = sum - totals[rank / block];
        sum += counts[order[rank]];
    }
    shared::Counts needed{};
    needed.instances = sum;
    const auto& grid = cpu.instances.grid;
    Guarded records("records", pack_records(cpu.projected), gpu::Texel::rgba32f), ranks("order", order),
        tiles("tile counts", counts), prefixes("prefix", prefix), bases("totals", totals),
        device_counts("counts", std::vector<shared::Counts>{needed}), keys("keys", capacity * 4),
        values("splats", capacity * 4), first("first", splats * 4);
    r.run([&](gpu::Recording& recording) {
        r.cache
            .get<passes::EmitInstances>({{shared::SPEC_MODE, with_first ? shared::EMIT_FIRST_INSTANCES : 0}})
            .record(recording,
                    {records, ranks, tiles, prefixes, bases, device_counts, keys, values, first, first},
                    {splats,
                     capacity,
                     block,
                     strip_rows,
                     {uint32_t(scene.camera.width), uint32_t(scene.camera.height)},
                     {uint32_t(grid.columns()), uint32_t(grid.rows())}});
    });
    expect_intact({&keys, &values, &first});
    return {keys.read<uint32_t>(), values.read<uint32_t>(), first.read<uint32_t>()};
}

struct InstanceCase {
    SplatKind kind;
    size_t splats;
    int width, height;
    uint32_t strip_rows;
};

class Emit : public testing::TestWithParam<InstanceCase> {};

TEST_P(Emit, ListsEveryExactTileAndFewMore) {
    const InstanceCase& c = GetParam();
    const Scene scene = random_scene(1300 + c.splats, c.splats, c.kind, c.width, c.height);
    const auto cpu =
        reference::render(scene.gaussians, scene.camera, scene.options, reference_tiles(rig().config()));
    const auto& grid = cpu.instances.grid;
    // Each splat is promised a few tiles more than it has, which the pass must fill with the number behind
    // the last tile.
    std::vector<std::vector<uint32_t>> exact;
    std::vector<uint32_t> counts;
    for (const auto& projected : cpu.projected) {
        exact.push_back(covered_tiles(projected, grid));
        const uint32_t n = uint32_t(exact.back().size());
        counts.push_back(n ? n + n / 2 + 9 : 0);
    }
    const uint32_t capacity = std::accumulate(counts.begin(), counts.end(), 0u);
    const Emitted out = run_emit(scene, cpu, counts, true, capacity, c.strip_rows);
    uint32_t at = 0;
    uint64_t exact_total = 0, listed_total = 0;
    for (const uint32_t splat : cpu.order) {
        if (!counts[splat]) continue;
        EXPECT_EQ(out.first[splat], at) << "splat " << splat;
        std::vector<uint32_t> listed;
        for (uint32_t j = 0; j < counts[splat]; ++j) {
            ASSERT_EQ(out.splats[at + j], splat);
            if (out.keys[at + j] != grid.count()) {
                EXPECT_EQ(listed.size(), j) << "a tile behind the padding";
                listed.push_back(out.keys[at + j]);
            }
        }
        EXPECT_TRUE(std::is_sorted(listed.begin(), listed.end()));
        EXPECT_EQ(std::adjacent_find(listed.begin(), listed.end()), listed.end());
        EXPECT_TRUE(std::includes(listed.begin(), listed.end(), exact[splat].begin(), exact[splat].end()))
            << "splat " << splat << " misses a tile";
        exact_total += exact[splat].size();
        listed_total += listed.size();
        at += counts[splat];
    }
    printf("    tiles: exact %zu, listed %zu\n", size_t(exact_total), size_t(listed_total));
    // An ellipse that enters a tile between two pixel centres is listed too: thin ones do that often.
    EXPECT_LE(double(listed_total), 1.02 * double(exact_total) + 4);
}

INSTANTIATE_TEST_SUITE_P(All, Emit,
                         testing::Values(InstanceCase{SplatKind::ordinary, 700, 160, 120, 1000},
                                         InstanceCase{SplatKind::ordinary, 701, 161, 121, 3},
                                         InstanceCase{SplatKind::needles, 700, 160, 120, 1},
                                         InstanceCase{SplatKind::mixed, 300, 17, 3, 1000},
                                         InstanceCase{SplatKind::mixed, 129, 1, 1, 1},
                                         InstanceCase{SplatKind::off_screen_and_close, 300, 130, 70, 4},
                                         InstanceCase{SplatKind::ordinary, 1, 33, 33, 2}),
                         [](const testing::TestParamInfo<InstanceCase>& tested) {
                             return std::string(name_of(tested.param.kind)) + "_" +
                                    std::to_string(tested.param.splats) + "_strips" +
                                    std::to_string(tested.param.strip_rows);
                         });

TEST(EmitEdges, NeverWritesPastAPromiseThatWasTooSmall) {
    const Scene scene = random_scene(1400, 200, SplatKind::ordinary, 160, 120);
    const auto cpu =
        reference::render(scene.gaussians, scene.camera, scene.options, reference_tiles(rig().config()));
    std::vector<uint32_t> counts;
    for (const auto& projected : cpu.projected) {
        const uint32_t n = uint32_t(covered_tiles(projected, cpu.instances.grid).size());
        counts.push_back(n > 1 ? n - 1 : n);
    }
    const uint32_t capacity = std::accumulate(counts.begin(), counts.end(), 0u);
    const Emitted out = run_emit(scene, cpu, counts, false, capacity, 2);
    uint32_t at = 0;
    for (const uint32_t splat : cpu.order)
        for (uint32_t j = 0; j < counts[splat]; ++j) ASSERT_EQ(out.splats[at++], splat);
    for (const uint32_t first : out.first) EXPECT_EQ(first, kPoison);  // asked for with gradients only
}

/// A driver may round the footprint of project and of this pass differently: here it may be empty.
TEST(EmitEdges, PadsThePromiseToASplatThatReachesNoTile) {
    Scene scene = random_scene(1402, 200, SplatKind::ordinary, 160, 120);
    for (size_t i = 0; i < 200; i += 5) scene.gaussians.opacity_logits[i] = -20;
    const auto cpu =
        reference::render(scene.gaussians, scene.camera, scene.options, reference_tiles(rig().config()));
    std::vector<uint32_t> counts;
    for (size_t i = 0; i < 200; ++i) {
        const auto tiles = covered_tiles(cpu.projected[i], cpu.instances.grid);
        EXPECT_TRUE(i % 5 != 0 || tiles.empty());
        counts.push_back(i % 5 == 0 ? 3 : uint32_t(tiles.size()));
    }
    const uint32_t capacity = std::accumulate(counts.begin(), counts.end(), 0u);
    const Emitted out = run_emit(scene, cpu, counts, false, capacity, 2);
    uint32_t padded = 0;
    for (uint32_t at = 0; at < capacity; ++at) {
        ASSERT_LT(out.splats[at], 200u) << at;
        if (out.splats[at] % 5 != 0) continue;
        EXPECT_EQ(out.keys[at], cpu.instances.grid.count()) << at;
        ++padded;
    }
    EXPECT_EQ(padded, 3u * 40);
}

TEST(EmitEdges, WritesNothingWhereNotAllFit) {
    const Scene scene = random_scene(1401, 200, SplatKind::ordinary, 160, 120);
    const auto cpu =
        reference::render(scene.gaussians, scene.camera, scene.options, reference_tiles(rig().config()));
    std::vector<uint32_t> counts;
    for (const auto& projected : cpu.projected)
        counts.push_back(uint32_t(covered_tiles(projected, cpu.instances.grid).size()));
    const uint32_t capacity = std::accumulate(counts.begin(), counts.end(), 0u) - 1;
    const Emitted out = run_emit(scene, cpu, counts, true, capacity, 100);
    for (const auto* words : {&out.keys, &out.splats, &out.first})
        for (const uint32_t word : *words) EXPECT_EQ(word, kPoison);
}

class Starts : public testing::TestWithParam<std::pair<uint32_t, uint32_t>> {};

TEST_P(Starts, AreTheLowerBounds) {
    const uint32_t tiles = GetParam().first, items = GetParam().second;
    Rig& r = rig();
    Random random(tiles + items);
    std::vector<uint32_t> sorted(std::max(items, 1u));
    // Up to `tiles` itself: the number of instances that do not exist.
    for (auto& key : sorted) key = uint32_t(random.bits() % (tiles + 1));
    std::sort(sorted.begin(), sorted.end());
    Guarded keys("keys", sorted), starts("tile starts", (tiles + 2) * 4);
    for (const bool fits : {true, false}) {
        shared::Counts needed{};
        needed.instances = items;
        Guarded counts("counts", std::vector<shared::Counts>{needed});
        r.run([&](gpu::Recording& recording) {
            r.cache.get<passes::TileStarts>().record(recording, {keys, counts, starts},
                                                     {tiles, fits ? items : items - 1});
        });
        if (!fits && items == 0) break;
        const auto actual = starts.read<uint32_t>();
        for (uint32_t tile = 0; tile <= tiles + 1; ++tile) {
            const auto bound = std::lower_bound(sorted.begin(), sorted.begin() + items, tile);
            ASSERT_EQ(actual[tile], fits ? uint32_t(bound - sorted.begin()) : 0u) << tile;
        }
        expect_intact({&starts});
        if (items == 0) break;
    }
}

INSTANTIATE_TEST_SUITE_P(Sizes, Starts,
                         testing::Values(std::pair{1u, 0u}, std::pair{1u, 1u}, std::pair{3u, 10000u},
                                         std::pair{300u, 7u}, std::pair{5000u, 20000u}));

class ListStarts : public testing::TestWithParam<uint32_t> {};

TEST_P(ListStarts, AreTheSumsOfTheLengthsBefore) {
    const uint32_t tiles = GetParam();
    Random random(tiles);
    std::vector<uint32_t> expected(tiles + 1);
    for (uint32_t& length : expected) length = uint32_t(random.bits() % 1000);
    Guarded lists("lists", expected), starts("tile starts", (tiles + 2) * 4);
    Rig& r = rig();
    r.run([&](gpu::Recording& recording) {
        r.cache.get<passes::ScanLists>().record(recording, {lists, starts}, {.tiles = tiles, .capacity = 0});
    });
    const uint32_t last = expected.back();
    std::exclusive_scan(expected.begin(), expected.end(), expected.begin(), 0u);
    EXPECT_EQ(lists.read<uint32_t>(), expected);
    expected.push_back(expected.back() + last);
    EXPECT_EQ(starts.read<uint32_t>(), expected);
    expect_intact({&lists, &starts});
}

INSTANTIATE_TEST_SUITE_P(Tiles, ListStarts, testing::Values(1u, 7u, 8u, 1022u, 1023u, 1024u, 5000u));

/// Lists of these lengths, in any order, with few different keys or many.
void expect_sorted_lists(const std::vector<uint32_t>& lengths, uint32_t different) {
    const uint32_t count = std::accumulate(lengths.begin(), lengths.end(), 0u);
    Random random(count + different);
    std::vector<uint32_t> starts{0}, keys, instances(count), splats(count);
    for (const uint32_t length : lengths) starts.push_back(starts.back() + length);
    std::iota(instances.begin(), instances.end(), 0u);
    std::shuffle(instances.begin(), instances.end(), std::mt19937(count));
    for (uint32_t i = 0; i < count; ++i) {
        keys.push_back(uint32_t(random.bits() % different) * (0xffffffffu / different));
        splats[i] = i ^ 0xa5000000u;
    }
    std::vector<uint32_t> expected(count), order(count);
    std::iota(order.begin(), order.end(), 0u);
    for (size_t tile = 0; tile < lengths.size(); ++tile)
        std::sort(order.begin() + starts[tile], order.begin() + starts[tile + 1],
                  [&](uint32_t a, uint32_t b) {
                      return std::pair(keys[a], instances[a]) < std::pair(keys[b], instances[b]);
                  });
    for (uint32_t at = 0; at < count; ++at) expected[at] = instances[order[at]];
    Rig& r = rig();
    for (const uint32_t mode : {shared::LISTS_SPLATS, shared::LISTS_TRACKED, shared::LISTS_EMITTED}) {
        SCOPED_TRACE(mode);
        Guarded device_starts("tile starts", starts), device_keys("keys", keys),
            sorted("instances", instances), device_splats("splats", splats),
            places("places", std::vector<uint32_t>(count, kPoison));
        r.run([&](gpu::Recording& recording) {
            r.cache.get<passes::SortLists>({{shared::SPEC_MODE, mode}})
                .record(recording, {device_starts, device_keys, sorted, device_splats, places},
                        {.tiles = uint32_t(lengths.size()) - 1, .capacity = count});
        });
        const auto actual = sorted.read<uint32_t>(), placed = places.read<uint32_t>();
        for (uint32_t at = 0; at < count; ++at) {
            ASSERT_EQ(actual[at], mode == shared::LISTS_EMITTED ? expected[at] : splats[expected[at]]) << at;
            ASSERT_EQ(placed[expected[at]], mode == shared::LISTS_TRACKED ? at : kPoison) << at;
        }
        expect_intact({&device_keys, &sorted, &places});
    }
}

TEST(SortedLists, AreInOrderWhateverTheirLength) {
    constexpr uint32_t kBlock = shared::LIST_BLOCK;
    const std::vector<uint32_t> lengths{0,
                                        1,
                                        2,
                                        3,
                                        0,
                                        5,
                                        8,
                                        31,
                                        64,
                                        65,
                                        127,
                                        kBlock - 1,
                                        kBlock,
                                        kBlock + 1,
                                        2 * kBlock,
                                        100,
                                        3 * kBlock + 17,
                                        1,
                                        0};
    for (const uint32_t different : {1u, 5u, 0xffffffffu}) expect_sorted_lists(lengths, different);
    expect_sorted_lists({9 * kBlock + 1}, 1000);
    expect_sorted_lists({std::min(passes::most_sorted_lists(device()->limits()), 1u << 16)}, 1u << 20);
    expect_sorted_lists({0, 1}, 1);
}

}  // namespace
}  // namespace ewa::test
