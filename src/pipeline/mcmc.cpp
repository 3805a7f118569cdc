// SPDX-License-Identifier: Apache-2.0
#include "pipeline/mcmc.h"

#include <algorithm>
#include <cmath>

#include "passes/strategy.h"
#include "pipeline/sorting.h"

namespace ewa::pipeline {
namespace {

/// Values of all splats with their prefix sums.
struct Scanned {
    gpu::Buffer values, prefix, totals;
    uint32_t sum = 0;

    Scanned(gpu::Device& device, const char* name, const Model& model, const FrameBuffers& frame)
        : values(device, name, 4ull * model.splats),
          prefix(device, name, 4ull * model.splats),
          totals(device, name, frame.sizes.scan_totals) {}
    void scan(passes::PassCache& cache, gpu::Executor& executor, const Model& model,
              const FrameBuffers& frame) {
        gpu::Recording recording(cache.device().limits());
        record_scan(
            recording, cache,
            {.source = values, .order = nullptr, .prefix = prefix, .totals = totals, .counts = frame.counts},
            {.items = model.splats,
             .block = frame.sizes.scan_block,
             .total = shared::TOTAL_SCAN,
             .name = "relocation offsets"});
        executor.run(recording);
        sum = frame.read_counts().scan_total;
    }
};

uint32_t grown(uint32_t splats, const McmcRules& rules) {
    const double target = std::floor(rules.growth * splats);
    return uint32_t(std::max<double>(splats, std::min<double>(target, rules.max_splats)));
}

}  // namespace

McmcResult refine_mcmc(passes::PassCache& cache, gpu::Executor& executor, Model& model,
                       const FrameBuffers& frame, const McmcRules& rules) {
    gpu::Device& device = cache.device();
    shared::McmcPush push{.splats = model.splats,
                          .planes = model.planes(),
                          .new_splats = 0,
                          .scan_block = frame.sizes.scan_block,
                          .dead = 0,
                          .draws = 0,
                          .total = 0,
                          .weight_scale = float(std::min(65535u, 0xffffffffu / std::max(model.splats, 1u))),
                          .dead_logit = float(std::log(rules.dead_opacity / (1 - rules.dead_opacity))),
                          .least_opacity = float(rules.dead_opacity),
                          .spread = float(rules.spread),
                          .seed = {uint32_t(rules.seed), uint32_t(rules.seed >> 32)},
                          .step = rules.step};

    Scanned weights(device, "weights", model, frame), dead(device, "dead", model, frame);
    {
        gpu::Recording recording(device.limits());
        cache.get<passes::McmcWeigh>().record(
            recording, {.params = model.params, .weights = weights.values, .dead = dead.values}, push);
        executor.run(recording);
    }
    weights.scan(cache, executor, model, frame);
    dead.scan(cache, executor, model, frame);
    push.total = weights.sum;
    push.dead = dead.sum;
    push.new_splats = grown(model.splats, rules);
    push.draws = push.dead + (push.new_splats - model.splats);
    if (push.draws == 0 || push.total == 0) return {model.splats, 0, model.splats};

    gpu::Buffer sources(device, "sources", 4ull * push.draws), hits(device, "hits", 4ull * model.splats);
    Model next = next_generation(device, model, push.new_splats);
    gpu::Recording recording(device.limits());
    recording.fill(hits, 0, 0, 4ull * model.splats);
    cache.get<passes::McmcDraw>().record(
        recording, {.prefix = weights.prefix, .totals = weights.totals, .sources = sources, .hits = hits},
        push);
    cache.get<passes::McmcWrite>({{shared::SPEC_SH_DEGREE, uint32_t(model.sh_degree)}})
        .record(recording,
                {.params = model.params,
                 .moments1 = model.moments1,
                 .moments2 = model.moments2,
                 .dead = dead.values,
                 .prefix = dead.prefix,
                 .totals = dead.totals,
                 .sources = sources,
                 .hits = hits,
                 .params_out = next.params,
                 .moments1_out = next.moments1,
                 .moments2_out = next.moments2},
                push);
    executor.run(recording);
    const McmcResult result{model.splats, push.dead, push.new_splats};
    model = std::move(next);
    return result;
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
                                         .step = noise.step});
}

}  // namespace ewa::pipeline
