// SPDX-License-Identifier: Apache-2.0
// The host's loops do what they are the ceiling of.
#include <gtest/gtest.h>

#include <cmath>

#include "bench/cases.h"
#include "bench/ceiling/ceiling.h"
#include "core/random.h"
#include "reference/render.h"

namespace ewa::test {
namespace {

TEST(Ceiling, SortsStablyByTheLowBits) {
    for (const uint32_t bits : {1u, 7u, 11u, 13u, 23u, 32u})
        for (const uint32_t items : {0u, 1u, 1000u, 100000u}) {
            std::vector<uint32_t> keys(items), values(items);
            for (uint32_t i = 0; i < items; ++i) {
                keys[i] = core::pcg4d({i, bits, 0, 0})[0] >> (32 - bits);
                values[i] = i;
            }
            const auto expected = reference::stable_order<uint32_t>(keys);
            bench::sort_pairs(keys, values, bits);
            EXPECT_EQ(values, expected) << bits << " bits, " << items << " items";
        }
}

/// A tiny case as the CPU reference renders it, and its lists as the device would hand them over.
struct Drawn {
    bench::BenchScene scene;
    reference::Rendered rendered;
    std::vector<float> records;
    std::vector<uint32_t> splats, tile_starts;
    bench::BlendLists lists;

    Drawn(int tile_width, int tile_height) {
        bench::Case one;
        one.layout = bench::Layout::capture;
        one.splats = 1500;
        one.width = 61;
        one.height = 43;
        scene = bench::make_scene(one);
        RenderOptions options;
        options.background = {0.1f, 0.2f, 0.3f};
        rendered = reference::render(scene.gaussians, scene.camera, options, {tile_width, tile_height, {}});
        for (const reference::Projected& splat : rendered.projected) add_record(splat);
        for (const reference::Instance& instance : rendered.instances.sorted)
            splats.push_back(instance.splat);
        for (const uint64_t first : rendered.instances.first_of_tile) tile_starts.push_back(uint32_t(first));
        lists.records = records.data();
        lists.splats = splats.data();
        lists.tile_starts = tile_starts.data();
        lists.width = uint32_t(one.width);
        lists.height = uint32_t(one.height);
        lists.tile_width = uint32_t(tile_width);
        lists.tile_height = uint32_t(tile_height);
        lists.tiles_x = uint32_t(rendered.instances.grid.columns());
        for (size_t c = 0; c < 3; ++c) lists.background[c] = options.background[c];
    }

  private:
    void add_record(const reference::Projected& splat) {
        std::array<float, 12> record{};
        if (splat.visible) {
            const auto w = reference::whitener(splat);
            const double half = std::sqrt(0.5);
            record = {float(splat.mean2d.x),
                      float(splat.mean2d.y),
                      0,
                      0,
                      float(half * w.ux),
                      float(-w.uy / w.ux),
                      float(half * w.vy),
                      float(splat.opacity),
                      float(splat.color.r),
                      float(splat.color.g),
                      float(splat.color.b),
                      float(splat.z)};
        }
        records.insert(records.end(), record.begin(), record.end());
    }
};

TEST(Ceiling, BlendsAndCountsAsTheReferenceDoes) {
    for (const auto& [width, height] : {std::pair(4, 16), std::pair(8, 8), std::pair(16, 8)}) {
        const Drawn drawn(width, height);
        const uint32_t tiles = drawn.rendered.instances.grid.count();
        std::vector<float> planes;
        bench::time_blend(drawn.lists, tiles, 1, planes);
        const size_t pixels = size_t(drawn.lists.width) * drawn.lists.height;
        uint64_t evaluated = 0, blended = 0;
        size_t off = 0;
        for (size_t i = 0; i < pixels; ++i) {
            evaluated += drawn.rendered.blended.evaluated[i];
            blended += drawn.rendered.blended.blended[i];
            for (size_t c = 0; c < 3; ++c)
                off += !(std::abs(planes[c * pixels + i] - drawn.rendered.blended.color.values[3 * i + c]) <
                         1e-5);
        }
        EXPECT_LE(off, pixels / 1000);
        // A contribution on a threshold may go either way in float32.
        const bench::PairCounts counts = bench::count_pairs(drawn.lists, tiles);
        EXPECT_NEAR(double(counts.evaluated), double(evaluated), 1e-3 * double(evaluated));
        EXPECT_NEAR(double(counts.blended), double(blended), 1e-3 * double(blended));
    }
}

}  // namespace
}  // namespace ewa::test
