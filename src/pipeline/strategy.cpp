// SPDX-License-Identifier: Apache-2.0
#include "pipeline/strategy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "passes/passes.h"
#include "pipeline/share.h"
#include "pipeline/sorting.h"

namespace ewa::pipeline {
namespace {

/// Records the prefix sums of a value a splat, runs the recording, and returns the sum of this rank's values.
uint32_t run_scan(gpu::Recording& recording, passes::PassCache& cache, gpu::Executor& executor,
                  const FrameBuffers& frame, const ScanBuffers& buffers, uint32_t splats, const char* name) {
    record_scan(
        recording, cache, buffers,
        {.items = splats, .block = frame.sizes.scan_block, .total = shared::TOTAL_SCAN, .name = name});
    frame.record_counts(recording);
    executor.run(recording);
    return frame.read_counts().scan_total;
}

shared::DensifyPush densify_push(const Model& model, const FrameBuffers& frame, const DensifyRules& rules,
                                 float threshold, uint32_t new_capacity) {
    return {.splats = model.splats,
            .planes = model.planes(),
            .new_capacity = new_capacity,
            .scan_block = frame.sizes.scan_block,
            .grow_gradient = threshold,
            .split_scale = rules.split_scale,
            .prune_opacity = rules.prune_logit,
            .prune_scale = rules.prune_scale,
            .seed = {uint32_t(rules.seed), uint32_t(rules.seed >> 32)},
            .step = rules.step,
            .first = model.share.first,
            .revised_opacity = rules.revised_opacity ? 1u : 0u};
}

/// The lowest threshold, at least that of the rules, whose generation fits under the cap; infinity if none
/// does. count: the splats of the next generation at a threshold.
float fitting_threshold(const DensifyRules& rules, const std::function<uint32_t(float)>& count) {
    if (count(rules.grow_gradient) <= rules.max_splats) return rules.grow_gradient;
    float low = rules.grow_gradient, high = 1e4f * rules.grow_gradient;
    if (count(high) > rules.max_splats) return std::numeric_limits<float>::infinity();
    // Bisection of the exponent: the interval shrinks from 1e4 to 1e4^(1/2^12), a step of 0.2 percent.
    for (int turn = 0; turn < 12; ++turn) {
        const float middle = std::sqrt(low * high);
        (count(middle) <= rules.max_splats ? high : low) = middle;
    }
    return high;
}

/// Values of all splats with their prefix sums.
struct Scanned {
    gpu::Buffer values, prefix, totals;

    Scanned() = default;
    Scanned(gpu::Device& device, const char* name, const Model& model, const FrameBuffers& frame)
        : values(device, name, 4ull * model.splats),
          prefix(device, name, 4ull * model.splats),
          totals(device, name, frame.sizes.scan_totals) {}
};

/// Of a kernel that writes an array of the next generation.
passes::Constants write_variant(const Model& model, bool is_moments) {
    return {{shared::SPEC_SH_DEGREE, uint32_t(model.sh_degree)},
            {shared::SPEC_MODE, is_moments ? shared::WRITE_MOMENTS : shared::WRITE_PARAMS}};
}

uint32_t grown(uint32_t splats, const McmcRules& rules) {
    const double target = std::floor(rules.growth * splats);
    return uint32_t(std::max<double>(splats, std::min<double>(target, rules.max_splats)));
}

}  // namespace

Refinement densify(passes::PassCache& cache, gpu::Executor& executor, Model& model, const FrameBuffers& frame,
                   const DensifyRules& rules) {
    gpu::Device& device = cache.device();
    // Leaves the offsets of the next generation in frame.prefix and frame.scan_totals.
    const auto count = [&](float threshold) {
        gpu::Recording recording(device.limits());
        cache.get<passes::DensifyDecide>().record(
            recording, {.params = model.params, .statistics = model.statistics, .outputs = frame.tile_counts},
            densify_push(model, frame, rules, threshold, 0));
        return run_scan(recording, cache, executor, frame,
                        {.source = frame.tile_counts,
                         .order = nullptr,
                         .prefix = frame.prefix,
                         .totals = frame.scan_totals,
                         .counts = frame.counts},
                        model.splats, "densify offsets");
    };
    Ranks& ranks = *model.share.ranks;
    const float threshold =
        fitting_threshold(rules, [&](float t) { return uint32_t(sum_over(ranks, count(t))); });
    const uint32_t after = count(threshold), before = model.share.all;
    if (sum_over(ranks, after) == 0) return {before, before, 0};
    // Ranks that are chunks of one process share the frame: others have left their offsets in it.
    if (ranks.size() > 1) count(threshold);

    const shared::DensifyPush push = densify_push(model, frame, rules, threshold, after);
    replace_generation(device, model, after,
                       [&](const gpu::Buffer& target, const gpu::Buffer& source, bool is_moments) {
                           gpu::Recording recording(device.limits());
                           cache.get<passes::DensifyWrite>(write_variant(model, is_moments))
                               .record(recording,
                                       {.params = model.params,
                                        .moments = is_moments ? source : model.moments1,
                                        .statistics = model.statistics,
                                        .prefix = frame.prefix,
                                        .totals = frame.scan_totals,
                                        .array_out = target},
                                       push);
                           executor.run(recording);
                       });
    model.statistics = gpu::Buffer();  // free the old ones first
    level(device, model);
    model.statistics = gpu::Buffer(device, "statistics", uint64_t(model.splats) * 8);
    zero(model.statistics);
    return {before, model.share.all, 0};
}

void record_reset_opacity(gpu::Recording& recording, passes::PassCache& cache, const Model& model,
                          float logit) {
    cache.get<passes::ResetOpacity>().record(
        recording, {.params = model.params, .moments1 = model.moments1, .moments2 = model.second_moments()},
        {.splats = model.splats, .planes = model.planes(), .logit = logit});
}

Refinement refine_mcmc(passes::PassCache& cache, gpu::Executor& executor, Model& model,
                       const FrameBuffers& frame, const McmcRules& rules) {
    gpu::Device& device = cache.device();
    shared::McmcPush push{
        .splats = model.splats,
        .planes = model.planes(),
        .new_splats = 0,
        .scan_block = frame.sizes.scan_block,
        .dead = 0,
        .draws = 0,
        .total = 0,
        .total_before = 0,
        .own_total = 0,
        .weight_scale = float(std::min(65535u, 0xffffffffu / std::max(model.share.all, 1u))),
        .dead_logit = float(std::log(rules.dead_opacity / (1 - rules.dead_opacity))),
        .least_opacity = float(rules.dead_opacity),
        .spread = float(rules.spread),
        .seed = {uint32_t(rules.seed), uint32_t(rules.seed >> 32)},
        .step = rules.step,
        .first = model.share.first};
    Ranks& ranks = *model.share.ranks;
    const size_t own = size_t(ranks.rank());

    Scanned weights(device, "weights", model, frame), dead(device, "dead", model, frame);
    gpu::Recording weigh(device.limits());
    cache.get<passes::McmcWeigh>().record(
        weigh, {.params = model.params, .weights = weights.values, .dead = dead.values}, push);
    executor.run(weigh);
    const auto sum = [&](const Scanned& scanned) {
        gpu::Recording recording(device.limits());
        return run_scan(recording, cache, executor, frame,
                        {.source = scanned.values,
                         .order = nullptr,
                         .prefix = scanned.prefix,
                         .totals = scanned.totals,
                         .counts = frame.counts},
                        model.splats, "relocation offsets");
    };
    push.own_total = sum(weights);
    push.dead = sum(dead);
    const std::vector<uint64_t> sums = ranks.gather(std::array<uint64_t, 2>{push.own_total, push.dead});
    uint32_t all_dead = 0;
    for (size_t rank = 0; 2 * rank < sums.size(); ++rank) {
        if (rank == own) push.total_before = push.total;
        push.total += uint32_t(sums[2 * rank]);
        all_dead += uint32_t(sums[2 * rank + 1]);
    }
    const uint32_t before = model.share.all, after = grown(before, rules), added = after - before;
    push.draws = all_dead + added;
    if (push.draws == 0 || push.total == 0) return {before, before, 0};

    gpu::Buffer sources(device, "sources", 4ull * push.draws), hits(device, "hits", 4ull * model.splats);
    gpu::Recording recording(device.limits());
    recording.fill(hits, 0, 0, 4ull * model.splats);
    cache.get<passes::McmcDraw>().record(
        recording, {.prefix = weights.prefix, .totals = weights.totals, .sources = sources, .hits = hits},
        push);
    executor.run(recording);
    weights = {};  // its memory is used again
    push.new_splats = model.splats;
    if (own + 1 == size_t(ranks.size())) push.new_splats += added;
    if (ranks.size() > 1) {
        ForeignSources fetched =
            fetch_sources(device, model, std::move(sources), std::move(hits), push.dead, added);
        sources = std::move(fetched.sources);
        hits = std::move(fetched.hits);
    }
    replace_generation(device, model, push.new_splats,
                       [&](const gpu::Buffer& target, const gpu::Buffer& source, bool is_moments) {
                           gpu::Recording write(device.limits());
                           passes::Constants variant = write_variant(model, is_moments);
                           variant.push_back({shared::SPEC_KERNEL, uint32_t(rules.kernel)});
                           cache.get<passes::McmcWrite>(variant).record(
                               write,
                               {.params = model.params,
                                .moments = is_moments ? source : model.moments1,
                                .dead = dead.values,
                                .prefix = dead.prefix,
                                .totals = dead.totals,
                                .sources = sources,
                                .hits = hits,
                                .array_out = target},
                               push);
                           executor.run(write);
                       });
    dead = {};  // others take their turn: their memory is used again
    sources = {};
    hits = {};
    level(device, model);
    return {before, after, all_dead};
}

void record_noise(gpu::Recording& recording, passes::PassCache& cache, const Model& model,
                  const FrameBuffers& frame, const Noise& noise) {
    cache.get<passes::Perturb>().record(recording, {.params = model.params, .counts = frame.counts},
                                        {.splats = model.splats,
                                         .planes = model.planes(),
                                         .instance_capacity = frame.instance_capacity,
                                         .amplitude = noise.amplitude,
                                         .max_length = noise.max_length,
                                         .seed = {uint32_t(noise.seed), uint32_t(noise.seed >> 32)},
                                         .step = noise.step,
                                         .first = model.share.first});
}

}  // namespace ewa::pipeline
