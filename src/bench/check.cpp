// SPDX-License-Identifier: Apache-2.0
#include "bench/check.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <span>

#include "ewa/renderer.h"
#include "reference/training.h"
#include "reference/blend.h"
#include "reference/projection.h"
#include "reference/render.h"
#include "shared/constants.h"

namespace ewa::bench {
namespace {

/// The buffers between projection and blending, on the host.
struct Lists {
    std::vector<float> records;
    std::vector<uint32_t> tile_counts, order, prefix, totals;  // one per splat; totals: one per block
    std::vector<uint32_t> keys, indices, splats, tile_starts;  // one per instance; tile_starts: one per tile
    uint32_t scan_block = 1, tiles = 0, instances = 0;
};

Lists download(const FrameRun& run) {
    const pipeline::FrameBuffers& frame = run.frame();
    const pipeline::Sizes& sizes = frame.sizes;
    const size_t n = run.model().splats;
    Lists lists;
    lists.records = run.records();
    lists.tile_counts = frame.tile_counts.download<uint32_t>(n);
    // Each pass of a sort writes the other of its two buffers.
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

std::vector<Check> check_project(const Lists& lists, const FrameRun& run, const BenchScene& scene) {
    double mean = 0, shape = 0, color = 0;
    uint64_t unseen = 0;
    for (size_t i = 0; i < lists.tile_counts.size(); ++i) {
        if (lists.tile_counts[i] == 0) continue;
        const auto expected = reference::project(scene.gaussians, i, scene.camera, run.options());
        if (!expected.visible) {
            ++unseen;
            continue;
        }
        const float* record = &lists.records[12 * i];
        const auto w = reference::whitener(expected);
        const double half = std::sqrt(0.5);  // the device's u and v include the 1/2 of the exponent
        mean = std::max({mean, std::abs(double(record[0]) + record[2] - expected.mean2d.x),
                         std::abs(double(record[1]) + record[3] - expected.mean2d.y)});
        shape = std::max({shape, relative(record[4], half * w.ux), relative(record[6], half * w.vy),
                          relative(record[7], expected.opacity), relative(record[11], expected.z)});
        for (int c = 0; c < 3; ++c) color = std::max(color, std::abs(record[8 + c] - expected.color[c]));
    }
    return {wrong_entries("project: visible splats that the reference skips", unseen),
            {"project: mean, px", mean, 1e-3},
            {"project: shape, opacity and depth, relative", shape, 1e-4},
            {"project: colour", color, 1e-5}};
}

constexpr double kPixelBound = 1e-5;     // of most pixels
constexpr double kPixelShare = 1e-3;     // share of pixels that may exceed it
constexpr double kGradientBound = 1e-3;  // |actual - expected| / |expected|
constexpr double kAdamBound = 1e-3;      // in learning rates

}  // namespace

std::vector<Check> check_lists(const FrameRun& run, const BenchScene& scene) {
    const Lists lists = download(run);
    std::vector<Check> checks = check_project(lists, run, scene);
    checks.push_back(check_depth_order(lists));
    checks.push_back(check_scan(lists));
    checks.push_back(check_tile_order(lists));
    checks.push_back(check_tile_starts(lists));
    return checks;
}

bool reference_is_feasible(const Case& one) {
    return one.splats <= 100000 && int64_t(one.width) * one.height <= 960 * 540;
}

std::vector<Check> check_picture(const FrameRun& run, const BenchScene& scene) {
    const auto expected = reference::render(scene.gaussians, scene.camera, run.options());
    const pipeline::Sizes& sizes = run.frame().sizes;
    const auto planes = run.frame().planes.download<float>(sizes.planes / 4);
    double worst = 0;
    uint64_t over = 0;
    for (int y = 0; y < scene.camera.height; ++y)
        for (int x = 0; x < scene.camera.width; ++x) {
            const size_t at = size_t(y) * sizes.stride + size_t(x);
            double error = 0;
            for (size_t c = 0; c < 3; ++c) {
                const double e =
                    std::abs(planes[c * sizes.plane_floats + at] - expected.blended.color.at(x, y)[c]);
                error = std::isfinite(e) ? std::max(error, e) : INFINITY;
            }
            worst = std::max(worst, error);
            over += !(error <= kPixelBound);
        }
    const double pixels = double(scene.camera.width) * scene.camera.height;
    return {{"picture: share of pixels off by more than 1e-5", double(over) / pixels, kPixelShare},
            {"picture: worst pixel", worst, shared::ALPHA_MIN + kPixelBound}};
}

std::vector<Check> check_gradient(std::shared_ptr<gpu::Device> device, const BenchScene& scene) {
    RenderOptions options;
    options.sh_degree = scene.gaussians.sh_degree;
    const LossGradient actual =
        loss_gradient(std::move(device), scene.gaussians, scene.camera, scene.photo, options);
    const auto expected = reference::loss_gradient(scene.gaussians, scene.camera, scene.photo, options);
    std::vector<Check> checks{{"loss", std::abs(actual.loss - expected.loss), 1e-5}};
    for_each_group(actual.gradient, expected.gradient, [&](const char* name, const auto& a, const auto& e) {
        checks.push_back(
            {std::string("gradient: ") + name + ", relative", relative_distance(a, e), kGradientBound});
    });
    return checks;
}

std::vector<Check> check_update(std::shared_ptr<gpu::Device> device, const BenchScene& scene) {
    // The first step has rate zero: it changes only the moments, which then hold the gradient of the second
    // step.
    FrameRun run(std::move(device), scene, true);
    const Gaussians m = download_model(run.model(), run.model().moments1);
    const Gaussians v = download_model(run.model(), run.model().moments2);
    constexpr float kRate = 0.01f;
    pipeline::Rates rates{kRate, kRate, kRate, kRate, kRate, kRate, 2};
    run.set_rates(rates);
    run.run();
    const Gaussians moved = download_model(run.model(), run.model().params);
    double worst = 0;
    const auto compare = [&](const std::vector<float>& from, const std::vector<float>& m1,
                             const std::vector<float>& v1, const std::vector<float>& to) {
        for (size_t i = 0; i < from.size(); ++i) {
            // A second moment near the smallest float32 has lost its digits, and the step depends on them.
            if (v1[i] != 0 && v1[i] < 1e-30f) continue;
            reference::AdamState state(1);
            state.m[0] = m1[i];
            state.v[0] = v1[i];
            double value = from[i];
            const double gradient = m1[i] / (1 - shared::ADAM_BETA1);
            reference::adam_step(std::span(&value, 1), std::span(&gradient, 1), state, kRate, 2);
            worst = std::max(worst, std::abs(value - double(to[i])) / kRate);
        }
    };
    const Gaussians& g = scene.gaussians;
    compare(g.means, m.means, v.means, moved.means);
    compare(g.quaternions, m.quaternions, v.quaternions, moved.quaternions);
    compare(g.log_scales, m.log_scales, v.log_scales, moved.log_scales);
    compare(g.opacity_logits, m.opacity_logits, v.opacity_logits, moved.opacity_logits);
    compare(g.sh, m.sh, v.sh, moved.sh);
    return {{"Adam: step, in learning rates", worst, kAdamBound}};
}

}  // namespace ewa::bench
