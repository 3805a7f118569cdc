// SPDX-License-Identifier: Apache-2.0
// Emission of (splat, tile) instances, and where each tile's begin, on inputs from the CPU reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

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
            .record(recording, {records, ranks, tiles, prefixes, bases, device_counts, keys, values, first},
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

}  // namespace
}  // namespace ewa::test
