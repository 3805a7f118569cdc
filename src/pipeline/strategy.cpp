// SPDX-License-Identifier: Apache-2.0
#include "pipeline/strategy.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "passes/passes.h"
#include "pipeline/sorting.h"

namespace ewa::pipeline {
namespace {

/// Values of all splats with their prefix sums.
struct Scanned {
    gpu::Buffer values, prefix, totals;

    Scanned(gpu::Device& device, const char* name, const Model& model, const FrameBuffers& frame)
        : values(device, name, 4ull * model.splats),
          prefix(device, name, 4ull * model.splats),
          totals(device, name, frame.sizes.scan_totals) {}
};

/// Records the prefix sums of a value a splat. The sum is in Counts.scan_total.
void record_sum(const Phase& phase, const passes::Recorder& on, const ScanBuffers& buffers, uint32_t splats,
                const char* name) {
    record_scan(
        on, buffers,
        {.items = splats, .block = phase.frame.sizes.scan_block, .total = shared::TOTAL_SCAN, .name = name});
    phase.frame.record_counts(on.recording);
}

shared::DensifyPush densify_push(const Model& model, const FrameBuffers& frame, const DensifyRules& rules,
                                 float threshold, uint32_t new_capacity) {
    shared::DensifyPush push{.splats = model.splats,
                             .planes = model.planes(),
                             .new_capacity = new_capacity,
                             .scan_block = frame.sizes.scan_block,
                             .grow_gradient = threshold,
                             .split_scale = rules.split_scale,
                             .prune_opacity = rules.prune_logit,
                             .prune_scale = rules.prune_scale,
                             .seed = {uint32_t(rules.seed), uint32_t(rules.seed >> 32)},
                             .step = rules.step,
                             .first = model.first,
                             .split = rules.split,
                             .region = {},
                             .ball = {},
                             .frozen = rules.frozen};
    std::ranges::copy(rules.region, push.region);
    std::ranges::copy(rules.ball, push.ball);
    return push;
}

/// The constants of a kernel that writes an array of the next generation.
passes::Constants write_variant(const Model& model, bool is_moments) {
    return {{shared::SPEC_SH_DEGREE, uint32_t(model.sh_degree)},
            {shared::SPEC_MODE, is_moments ? shared::WRITE_MOMENTS : shared::WRITE_PARAMS}};
}

uint32_t grown(uint32_t splats, const McmcRules& rules) {
    const double target = std::floor(rules.growth * splats);
    return uint32_t(std::max<double>(splats, std::min<double>(target, rules.max_splats)));
}

shared::McmcPush mcmc_push(const Phase& phase, const Model& model, const McmcRules& rules,
                           const McmcPart& part) {
    shared::McmcPush push{.splats = model.splats,
                          .planes = model.planes(),
                          .new_splats = model.splats + part.added,
                          .scan_block = phase.frame.sizes.scan_block,
                          .dead = part.dead,
                          .draws = part.draws,
                          .total = part.all_weight,
                          .total_before = part.weight_before,
                          .own_total = part.weight,
                          .weight_scale = float(std::min(65535u, 0xffffffffu / std::max(model.all, 1u))),
                          .dead_logit = float(std::log(rules.dead_opacity / (1 - rules.dead_opacity))),
                          .least_opacity = float(rules.dead_opacity),
                          .spread = float(rules.spread),
                          .region = {},
                          .seed = {uint32_t(rules.seed), uint32_t(rules.seed >> 32)},
                          .step = rules.step,
                          .first = model.first,
                          .frozen = rules.frozen};
    std::ranges::copy(rules.region, push.region);
    return push;
}

/// Which splats are frozen is read only where some are. Else the binding takes another buffer, since the moments may be on the host.
const gpu::Buffer& marks(const Model& model, bool frozen) {
    return frozen ? model.moments1 : model.params;
}

/// The weights of a model's splats as sources, and which of them are dead.
struct Weighed {
    Scanned weights, dead;
    McmcPart sums;

    Weighed(const Phase& phase, const Model& model, const shared::McmcPush& push)
        : weights(phase.cache.device(), "weights", model, phase.frame),
          dead(phase.cache.device(), "dead", model, phase.frame) {
        phase.run([&](const passes::Recorder& on) {
            on.record(passes::McmcWeigh{.params = model.params,
                                        .weights = weights.values,
                                        .dead = dead.values,
                                        .moments = marks(model, push.frozen != 0)},
                      push);
        });
        sums.weight = sum(phase, weights, model.splats);
        sums.dead = sum(phase, dead, model.splats);
    }

  private:
    static uint32_t sum(const Phase& phase, const Scanned& scanned, uint32_t splats) {
        phase.run([&](const passes::Recorder& on) {
            record_sum(phase, on,
                       {.source = scanned.values,
                        .order = nullptr,
                        .prefix = scanned.prefix,
                        .totals = scanned.totals,
                        .counts = phase.frame.counts},
                       splats, "relocation offsets");
        });
        return phase.frame.read_counts().scan_total;
    }
};

}  // namespace

uint32_t count_densified(const Phase& phase, const Model& model, const DensifyRules& rules, float threshold) {
    const FrameBuffers& frame = phase.frame;
    phase.run([&](const passes::Recorder& on) {
        on.record(passes::DensifyDecide{.params = model.params,
                                        .statistics = model.statistics,
                                        .outputs = frame.tile_counts,
                                        .moments = marks(model, rules.frozen)},
                  densify_push(model, frame, rules, threshold, 0));
        // Leaves the offsets of the next generation in frame.prefix and frame.scan_totals.
        record_sum(phase, on,
                   {.source = frame.tile_counts,
                    .order = nullptr,
                    .prefix = frame.prefix,
                    .totals = frame.scan_totals,
                    .counts = frame.counts},
                   model.splats, "densify offsets");
    });
    return frame.read_counts().scan_total;
}

Densified decide_densify(const DensifyRules& rules, const std::function<uint64_t(float)>& count) {
    const auto at = [&](float threshold) { return Densified{threshold, count(threshold)}; };
    Densified fitting = at(rules.grow_gradient);
    if (fitting.splats <= rules.max_splats) return fitting;
    float low = rules.grow_gradient;
    fitting = at(1e4f * rules.grow_gradient);
    if (fitting.splats > rules.max_splats) return at(std::numeric_limits<float>::infinity());
    // Bisection of the exponent: the interval shrinks from 1e4 to 1e4^(1/2^12), a step of 0.2 percent.
    for (int turn = 0; turn < 12; ++turn) {
        const Densified middle = at(std::sqrt(low * fitting.threshold));
        if (middle.splats <= rules.max_splats)
            fitting = middle;
        else
            low = middle.threshold;
    }
    return fitting;
}

void write_densified(const Phase& phase, Model& model, const DensifyRules& rules, float threshold) {
    const FrameBuffers& frame = phase.frame;
    const uint32_t after = count_densified(phase, model, rules, threshold);
    const shared::DensifyPush push = densify_push(model, frame, rules, threshold, after);
    replace_generation(phase.cache.device(), model, after,
                       [&](const gpu::Buffer& target, const gpu::Buffer& source, bool is_moments) {
                           phase.run([&](const passes::Recorder& on) {
                               on.record(passes::DensifyWrite{.params = model.params,
                                                              .moments = is_moments ? source : model.moments1,
                                                              .statistics = model.statistics,
                                                              .prefix = frame.prefix,
                                                              .totals = frame.scan_totals,
                                                              .array_out = target},
                                         push, write_variant(model, is_moments));
                           });
                       });
    model.statistics = gpu::Buffer();
}

void record_reset_opacity(const passes::Recorder& on, const Model& model, float logit) {
    on.record(
        passes::ResetOpacity{
            .params = model.params, .moments1 = model.moments1, .moments2 = model.second_moments()},
        {.splats = model.splats, .planes = model.planes(), .logit = logit});
}

McmcPart weigh_mcmc(const Phase& phase, const Model& model, const McmcRules& rules) {
    return Weighed(phase, model, mcmc_push(phase, model, rules, {})).sums;
}

Refinement decide_mcmc(std::span<McmcPart> parts, uint32_t splats, const McmcRules& rules) {
    McmcPart sums;
    for (McmcPart& part : parts) {
        part.weight_before = sums.weight;
        part.first_draw = sums.dead;
        sums.weight += part.weight;
        sums.dead += part.dead;
    }
    const uint32_t after = grown(splats, rules), added = after - splats;
    const bool changes = sums.dead + added > 0 && sums.weight > 0;
    for (McmcPart& part : parts) {
        part.all_weight = sums.weight;
        part.draws = changes ? sums.dead + added : 0;
    }
    if (!changes) return {splats, splats, 0};
    parts.back().added = added;
    return {splats, after, sums.dead};
}

McmcSources draw_mcmc(const Phase& phase, const Model& model, const McmcRules& rules, const McmcPart& part) {
    gpu::Device& device = phase.cache.device();
    const shared::McmcPush push = mcmc_push(phase, model, rules, part);
    const Weighed weighed(phase, model, push);
    McmcSources drawn{gpu::Buffer(device, "sources", 4ull * part.draws),
                      gpu::Buffer(device, "hits", 4ull * model.splats)};
    phase.run([&](const passes::Recorder& on) {
        on.recording.fill(drawn.hits, 0, 0, 4ull * model.splats);
        on.record(passes::McmcDraw{.prefix = weighed.weights.prefix,
                                   .totals = weighed.weights.totals,
                                   .sources = drawn.sources,
                                   .hits = drawn.hits},
                  push);
    });
    return drawn;
}

void write_mcmc(const Phase& phase, Model& model, const McmcRules& rules, const McmcPart& part,
                const McmcSources& from) {
    const shared::McmcPush push = mcmc_push(phase, model, rules, part);
    const Scanned dead = Weighed(phase, model, push).dead;
    replace_generation(phase.cache.device(), model, push.new_splats,
                       [&](const gpu::Buffer& target, const gpu::Buffer& source, bool is_moments) {
                           passes::Constants variant = write_variant(model, is_moments);
                           variant.push_back({shared::SPEC_KERNEL, uint32_t(rules.kernel)});
                           phase.run([&](const passes::Recorder& on) {
                               on.record(passes::McmcWrite{.params = model.params,
                                                           .moments = is_moments ? source : model.moments1,
                                                           .dead = dead.values,
                                                           .prefix = dead.prefix,
                                                           .totals = dead.totals,
                                                           .sources = from.sources,
                                                           .hits = from.hits,
                                                           .array_out = target},
                                         push, variant);
                           });
                       });
}

namespace {

shared::PerturbBlock noise_values(const Model& model, const FrameBuffers& frame, const Noise& noise) {
    return {.splats = model.splats,
            .planes = model.planes(),
            .instance_capacity = frame.instance_capacity,
            .amplitude = noise.amplitude,
            .max_length = noise.max_length,
            .seed = {uint32_t(noise.seed), uint32_t(noise.seed >> 32)},
            .step = noise.step,
            .first = model.first,
            .frozen = noise.frozen};
}

}  // namespace

void record_noise_values(gpu::Recording& recording, const Model& model, const FrameBuffers& frame,
                         const Noise& noise) {
    const shared::PerturbBlock values = noise_values(model, frame, noise);
    recording.write(frame.noise_values, 0, std::as_bytes(std::span(&values, 1)));
}

void record_noise(const passes::Recorder& on, const Model& model, const FrameBuffers& frame,
                  const Noise& noise, bool written) {
    if (!written) record_noise_values(on.recording, model, frame, noise);
    on.record(passes::Perturb{.params = model.params,
                              .counts = frame.counts,
                              .moments = marks(model, noise.frozen),
                              .values = frame.noise_values},
              noise_values(model, frame, noise));
}

}  // namespace ewa::pipeline
