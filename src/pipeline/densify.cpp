// SPDX-License-Identifier: Apache-2.0
#include "pipeline/densify.h"

#include <cmath>
#include <limits>

#include "pipeline/sorting.h"

namespace ewa::pipeline {
namespace {

shared::DensifyPush push_of(const Model& model, const Frame& frame, const DensifyRules& rules,
                            float threshold, uint32_t new_capacity) {
    return {model.splats,
            model.planes(),
            new_capacity,
            frame.sizes.scan_block,
            threshold,
            rules.split_scale,
            rules.prune_logit,
            rules.prune_scale,
            {uint32_t(rules.seed), uint32_t(rules.seed >> 32)},
            rules.step,
            rules.revised_opacity ? 1u : 0u};
}

/// Splats of the next generation at a threshold; leaves their offsets in frame.prefix and frame.scan_totals.
uint32_t count_outputs(Kernels& kernels, gpu::Executor& executor, const Model& model, const Frame& frame,
                       const DensifyRules& rules, float threshold) {
    gpu::Recording recording(kernels.device().limits());
    kernels.get<passes::DensifyDecide>().record(recording, kernels.shape(),
                                                {model.params, model.statistics, frame.tile_counts},
                                                push_of(model, frame, rules, threshold, 0));
    record_scan(recording, kernels,
                {frame.tile_counts, nullptr, frame.prefix, frame.scan_totals, frame.counts}, model.splats,
                frame.sizes.scan_block, Total::densified, "densify offsets");
    executor.run(recording);
    return frame.read_counts().scan_total;
}

/// The lowest threshold, at least the rules' own, whose generation fits under the cap; infinity where none
/// does.
float fitting_threshold(Kernels& kernels, gpu::Executor& executor, const Model& model, const Frame& frame,
                        const DensifyRules& rules) {
    const float never = std::numeric_limits<float>::infinity();
    if (count_outputs(kernels, executor, model, frame, rules, rules.grow_gradient) <= rules.max_splats)
        return rules.grow_gradient;
    float low = rules.grow_gradient, high = 1e4f * rules.grow_gradient;
    if (count_outputs(kernels, executor, model, frame, rules, high) > rules.max_splats) return never;
    // Bisection of the exponent: 1e4 down to 1e4^(1/2^12), a step of 0.2 percent.
    for (int turn = 0; turn < 12; ++turn) {
        const float middle = std::sqrt(low * high);
        const bool fits = count_outputs(kernels, executor, model, frame, rules, middle) <= rules.max_splats;
        (fits ? high : low) = middle;
    }
    return high;
}

}  // namespace

DensifyResult densify(Kernels& kernels, gpu::Executor& executor, Model& model, Frame& frame,
                      const DensifyRules& rules) {
    gpu::Device& device = kernels.device();
    const float threshold = fitting_threshold(kernels, executor, model, frame, rules);
    const uint32_t after = count_outputs(kernels, executor, model, frame, rules, threshold);
    const DensifyResult result{model.splats, after};
    if (after == 0) return {model.splats, model.splats};

    Model next = next_generation(device, model, after);
    gpu::Recording recording(device.limits());
    kernels.get<passes::DensifyWrite>(uint32_t(model.sh_degree))
        .record(recording, kernels.shape(),
                {model.params, model.moments1, model.moments2, model.statistics, frame.prefix,
                 frame.scan_totals, next.params, next.moments1, next.moments2},
                push_of(model, frame, rules, threshold, after));
    executor.run(recording);
    next.statistics = gpu::Buffer(device, "statistics", uint64_t(after) * 8);
    zero(next.statistics);
    model = std::move(next);
    return result;
}

void record_reset_opacity(gpu::Recording& recording, Kernels& kernels, const Model& model, float logit) {
    kernels.get<passes::ResetOpacity>().record(recording, kernels.shape(),
                                               {model.params, model.moments1, model.moments2},
                                               {model.splats, model.planes(), logit});
}

}  // namespace ewa::pipeline
