// SPDX-License-Identifier: Apache-2.0
// The phases of a refinement, for a scene in one portion.
#pragma once
#include "pipeline/strategy.h"

namespace ewa::test {

inline pipeline::Refinement densify(const pipeline::Phase& phase, pipeline::Model& model,
                                    const pipeline::DensifyRules& rules) {
    const uint32_t before = model.splats;
    const pipeline::Densified next = decide_densify(
        rules, [&](float threshold) { return count_densified(phase, model, rules, threshold); });
    if (next.splats == 0) return {before, before, 0};
    write_densified(phase, model, rules, next.threshold);
    model.statistics = pipeline::fresh_statistics(phase.cache.device(), model.splats);
    model.all = model.splats;
    return {before, model.splats, 0};
}

inline pipeline::Refinement refine_mcmc(const pipeline::Phase& phase, pipeline::Model& model,
                                        const pipeline::McmcRules& rules) {
    pipeline::McmcPart part = weigh_mcmc(phase, model, rules);
    const pipeline::Refinement result = decide_mcmc(std::span(&part, 1), model.splats, rules);
    if (part.draws == 0) return result;
    write_mcmc(phase, model, rules, part, draw_mcmc(phase, model, rules, part));
    model.all = model.splats;
    return result;
}

}  // namespace ewa::test
