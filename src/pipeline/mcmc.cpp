// SPDX-License-Identifier: Apache-2.0
#include "pipeline/mcmc.h"

#include <algorithm>
#include <cmath>

#include "pipeline/sorting.h"

namespace ewa::pipeline {
namespace {

struct Scanned {
    gpu::Buffer values, prefix, totals;
    uint32_t sum = 0;

    Scanned(gpu::Device& device, const char* name, const Model& model, const Frame& frame)
        : values(device, name, 4ull * model.splats),
          prefix(device, name, 4ull * model.splats),
          totals(device, name, frame.sizes.scan_totals) {}
    void scan(Kernels& kernels, gpu::Executor& executor, const Model& model, const Frame& frame) {
        gpu::Recording recording(kernels.device().limits());
        record_scan(recording, kernels, {values, nullptr, prefix, totals, frame.counts}, model.splats,
                    frame.sizes.scan_block, Total::densified, "relocation offsets");
        executor.run(recording);
        sum = frame.read_counts().scan_total;
    }
};

uint32_t grown(uint32_t splats, const McmcRules& rules) {
    const double target = std::floor(rules.growth * splats);
    return uint32_t(std::max<double>(splats, std::min<double>(target, rules.max_splats)));
}

}  // namespace

McmcResult refine_mcmc(Kernels& kernels, gpu::Executor& executor, Model& model, const Frame& frame,
                       const McmcRules& rules) {
    gpu::Device& device = kernels.device();
    const passes::Shape& shape = kernels.shape();
    shared::McmcPush push{};
    push.splats = model.splats;
    push.planes = model.planes();
    push.scan_block = frame.sizes.scan_block;
    push.weight_scale = float(std::min(65535u, 0xffffffffu / std::max(model.splats, 1u)));
    push.dead_logit = float(std::log(rules.dead_opacity / (1 - rules.dead_opacity)));
    push.least_opacity = float(rules.dead_opacity);
    push.spread = float(rules.spread);
    push.seed[0] = uint32_t(rules.seed);
    push.seed[1] = uint32_t(rules.seed >> 32);
    push.step = rules.step;

    Scanned weights(device, "weights", model, frame), dead(device, "dead", model, frame);
    {
        gpu::Recording recording(device.limits());
        kernels.get<passes::McmcWeigh>().record(recording, shape, {model.params, weights.values, dead.values},
                                                push);
        executor.run(recording);
    }
    weights.scan(kernels, executor, model, frame);
    dead.scan(kernels, executor, model, frame);
    push.total = weights.sum;
    push.dead = dead.sum;
    push.new_splats = grown(model.splats, rules);
    push.draws = push.dead + (push.new_splats - model.splats);
    if (push.draws == 0 || push.total == 0) return {model.splats, 0, model.splats};

    gpu::Buffer sources(device, "sources", 4ull * push.draws), hits(device, "hits", 4ull * model.splats);
    Model next = next_generation(device, model, push.new_splats);
    gpu::Recording recording(device.limits());
    recording.fill(hits, 0, 0, 4ull * model.splats);
    kernels.get<passes::McmcDraw>().record(recording, shape, {weights.prefix, weights.totals, sources, hits},
                                           push);
    kernels.get<passes::McmcWrite>(uint32_t(model.sh_degree))
        .record(recording, shape,
                {model.params, model.moments1, model.moments2, dead.values, dead.prefix, dead.totals, sources,
                 hits, next.params, next.moments1, next.moments2},
                push);
    executor.run(recording);
    const McmcResult result{model.splats, push.dead, push.new_splats};
    model = std::move(next);
    return result;
}

void record_noise(gpu::Recording& recording, Kernels& kernels, const Model& model, const Frame& frame,
                  float amplitude, float reach, uint64_t seed, uint32_t step) {
    kernels.get<passes::Perturb>().record(recording, kernels.shape(), {model.params, frame.counts},
                                          {model.splats,
                                           model.planes(),
                                           frame.instance_capacity,
                                           amplitude,
                                           reach,
                                           {uint32_t(seed), uint32_t(seed >> 32)},
                                           step});
}

}  // namespace ewa::pipeline
