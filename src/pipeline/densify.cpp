// SPDX-License-Identifier: Apache-2.0
#include "pipeline/densify.h"

#include <cmath>
#include <limits>

#include "passes/strategy.h"
#include "pipeline/sorting.h"

namespace ewa::pipeline {
namespace {

shared::DensifyPush push_of(const Model& model, const FrameBuffers& frame, const DensifyRules& rules,
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
            .revised_opacity = rules.revised_opacity ? 1u : 0u};
}

/// Number of splats in the next generation at a threshold. Leaves their offsets
/// in frame.prefix and frame.scan_totals.
uint32_t count_outputs(passes::PassCache& cache, gpu::Executor& executor, const Model& model,
                       const FrameBuffers& frame, const DensifyRules& rules, float threshold) {
    gpu::Recording recording(cache.device().limits());
    cache.get<passes::DensifyDecide>().record(
        recording, {.params = model.params, .statistics = model.statistics, .outputs = frame.tile_counts},
        push_of(model, frame, rules, threshold, 0));
    record_scan(recording, cache,
                {.source = frame.tile_counts,
                 .order = nullptr,
                 .prefix = frame.prefix,
                 .totals = frame.scan_totals,
                 .counts = frame.counts},
                {.items = model.splats,
                 .block = frame.sizes.scan_block,
                 .total = shared::TOTAL_SCAN,
                 .name = "densify offsets"});
    executor.run(recording);
    return frame.read_counts().scan_total;
}

/// The lowest threshold, at least that of the rules, whose generation fits under the cap;
/// infinity if none does.
float fitting_threshold(passes::PassCache& cache, gpu::Executor& executor, const Model& model,
                        const FrameBuffers& frame, const DensifyRules& rules) {
    const float never = std::numeric_limits<float>::infinity();
    if (count_outputs(cache, executor, model, frame, rules, rules.grow_gradient) <= rules.max_splats)
        return rules.grow_gradient;
    float low = rules.grow_gradient, high = 1e4f * rules.grow_gradient;
    if (count_outputs(cache, executor, model, frame, rules, high) > rules.max_splats) return never;
    // Bisection of the exponent: the interval shrinks from 1e4 to 1e4^(1/2^12), a step of 0.2 percent.
    for (int turn = 0; turn < 12; ++turn) {
        const float middle = std::sqrt(low * high);
        const bool fits = count_outputs(cache, executor, model, frame, rules, middle) <= rules.max_splats;
        (fits ? high : low) = middle;
    }
    return high;
}

}  // namespace

DensifyResult densify(passes::PassCache& cache, gpu::Executor& executor, Model& model,
                      const FrameBuffers& frame, const DensifyRules& rules) {
    gpu::Device& device = cache.device();
    const float threshold = fitting_threshold(cache, executor, model, frame, rules);
    const uint32_t after = count_outputs(cache, executor, model, frame, rules, threshold);
    const DensifyResult result{model.splats, after};
    if (after == 0) return {model.splats, model.splats};

    Model next = next_generation(device, model, after);
    gpu::Recording recording(device.limits());
    cache.get<passes::DensifyWrite>({{shared::SPEC_SH_DEGREE, uint32_t(model.sh_degree)}})
        .record(recording,
                {.params = model.params,
                 .moments1 = model.moments1,
                 .moments2 = model.moments2,
                 .statistics = model.statistics,
                 .prefix = frame.prefix,
                 .totals = frame.scan_totals,
                 .params_out = next.params,
                 .moments1_out = next.moments1,
                 .moments2_out = next.moments2},
                push_of(model, frame, rules, threshold, after));
    executor.run(recording);
    next.statistics = gpu::Buffer(device, "statistics", uint64_t(after) * 8);
    zero(next.statistics);
    model = std::move(next);
    return result;
}

void record_reset_opacity(gpu::Recording& recording, passes::PassCache& cache, const Model& model,
                          float logit) {
    cache.get<passes::ResetOpacity>().record(
        recording, {.params = model.params, .moments1 = model.moments1, .moments2 = model.moments2},
        {.splats = model.splats, .planes = model.planes(), .logit = logit});
}

}  // namespace ewa::pipeline
