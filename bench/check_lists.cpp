// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <cmath>

#include "bench/check.h"
#include "reference/footprint.h"
#include "reference/projection.h"
#include "reference/scan.h"
#include "reference/sort.h"

namespace ewa::bench {
namespace {

/// Everything between projection and blending, on the host.
struct Lists {
    std::vector<float> records;
    std::vector<uint32_t> tile_counts, order, prefix, totals;  // one a splat; totals one a block
    std::vector<uint32_t> keys, indices, splats, tile_starts;  // one an instance; sorted_splats
    uint32_t scan_block = 1, tiles = 0, instances = 0;
};

Lists download(const FrameRun& run) {
    const pipeline::FrameBuffers& frame = run.frame();
    const pipeline::Sizes& sizes = frame.sizes;
    const size_t n = run.model().splats;
    Lists lists;
    lists.records = run.records();
    lists.tile_counts = frame.tile_counts.download<uint32_t>(n);
    // Each pass of a sort goes to the other of its two buffers, from the first on.
    lists.order = frame.order[sizes.depth_sort.passes & 1].download<uint32_t>(n);
    lists.prefix = frame.prefix.download<uint32_t>(n);
    lists.totals = frame.scan_totals.download<uint32_t>(size_t(sizes.scan_blocks) + 1);
    lists.instances = run.counts().instances;
    lists.keys = frame.instance_keys[sizes.tile_sort.passes & 1].download<uint32_t>(lists.instances);
    if (run.plan().gradients) lists.indices = run.sorted().indices->download<uint32_t>(lists.instances);
    lists.splats = run.sorted_splats();
    lists.tile_starts = run.tile_starts();
    lists.scan_block = sizes.scan_block;
    lists.tiles = sizes.tiles;
    return lists;
}

Check wrong_entries(const char* what, uint64_t wrong) {
    return {what, double(wrong), 0};
}

Check check_depth_order(const Lists& lists) {
    std::vector<uint32_t> keys(lists.tile_counts.size());
    for (size_t i = 0; i < keys.size(); ++i)
        keys[i] =
            lists.tile_counts[i] > 0 ? std::bit_cast<uint32_t>(lists.records[12 * i + 11]) : 0xffffffffu;
    const auto expected = reference::stable_order<uint32_t>(keys);
    uint64_t wrong = 0;
    for (size_t i = 0; i < keys.size(); ++i) wrong += lists.order[i] != expected[i];
    return wrong_entries("depth order: wrong entries", wrong);
}

Check check_scan(const Lists& lists) {
    std::vector<uint32_t> counts(lists.order.size());
    for (size_t rank = 0; rank < counts.size(); ++rank)
        counts[rank] = lists.order[rank] < counts.size() ? lists.tile_counts[lists.order[rank]] : 0;
    const auto expected = reference::exclusive_scan(counts);
    uint64_t wrong = expected.back() != lists.instances;
    for (size_t rank = 0; rank < counts.size(); ++rank)
        wrong += lists.totals[rank / lists.scan_block] + lists.prefix[rank] != expected[rank];
    return wrong_entries("instance offsets: wrong entries", wrong);
}

/// Tiles ascend; within a tile instances stand in the order they were emitted in, which is that of depth; and
/// every splat is there as often as it was counted; with gradients, no two instances share a place.
Check check_tile_order(const Lists& lists) {
    const size_t n = lists.tile_counts.size();
    std::vector<uint32_t> rank(n), times(n);
    for (uint32_t r = 0; r < n; ++r)
        if (lists.order[r] < n) rank[lists.order[r]] = r;
    uint64_t wrong = 0;
    for (size_t k = 0; k < lists.instances; ++k) {
        if (lists.splats[k] >= n) {
            ++wrong;
            continue;
        }
        ++times[lists.splats[k]];
        if (k == 0 || lists.splats[k - 1] >= n) continue;
        const bool later = rank[lists.splats[k - 1]] < rank[lists.splats[k]];
        wrong += lists.keys[k - 1] > lists.keys[k] || (lists.keys[k - 1] == lists.keys[k] && !later);
    }
    for (size_t i = 0; i < n; ++i) wrong += times[i] != lists.tile_counts[i];
    std::vector<uint32_t> taken(lists.indices.size());
    for (const uint32_t index : lists.indices) wrong += index >= taken.size() || ++taken[index] != 1;
    return wrong_entries("tile order: wrong entries", wrong);
}

Check check_tile_starts(const Lists& lists) {
    uint64_t wrong = 0;
    for (uint32_t tile = 0; tile <= lists.tiles; ++tile) {
        const auto first = std::lower_bound(lists.keys.begin(), lists.keys.end(), tile);
        wrong += lists.tile_starts[tile] != uint32_t(first - lists.keys.begin());
    }
    return wrong_entries("tile starts: wrong entries", wrong);
}

double relative(double actual, double expected) {
    const double error = std::abs(actual - expected) / std::max(std::abs(expected), 1e-30);
    return std::isfinite(error) ? error : INFINITY;
}

std::vector<Check> check_project(const Lists& lists, const FrameRun& run, const Scene& scene) {
    double mean = 0, shape = 0, color = 0;
    uint64_t unseen = 0;
    for (size_t i = 0; i < lists.tile_counts.size(); ++i) {
        if (lists.tile_counts[i] == 0) continue;
        const auto twin = reference::project(scene.gaussians, i, scene.camera, run.options());
        if (!twin.visible) {
            ++unseen;
            continue;
        }
        const float* record = &lists.records[12 * i];
        const auto w = reference::whitener(twin);
        const double half = std::sqrt(0.5);  // the device's u and v carry the exponent's 1/2
        mean = std::max({mean, std::abs(double(record[0]) + record[2] - twin.mean2d.x),
                         std::abs(double(record[1]) + record[3] - twin.mean2d.y)});
        shape = std::max({shape, relative(record[4], half * w.ux), relative(record[6], half * w.vy),
                          relative(record[7], twin.opacity), relative(record[11], twin.z)});
        for (int c = 0; c < 3; ++c) color = std::max(color, std::abs(record[8 + c] - twin.color[c]));
    }
    return {wrong_entries("project: splats drawn that the twin does not see", unseen),
            {"project: mean, px", mean, 1e-3},
            {"project: shape, opacity and depth, relative", shape, 1e-4},
            {"project: colour", color, 1e-5}};
}

}  // namespace

std::vector<Check> check_lists(const FrameRun& run, const Scene& scene) {
    const Lists lists = download(run);
    std::vector<Check> checks = check_project(lists, run, scene);
    checks.push_back(check_depth_order(lists));
    checks.push_back(check_scan(lists));
    checks.push_back(check_tile_order(lists));
    checks.push_back(check_tile_starts(lists));
    return checks;
}

}  // namespace ewa::bench
