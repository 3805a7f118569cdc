// SPDX-License-Identifier: Apache-2.0
// The phases of a refinement, for a scene in one portion.
#pragma once
#include <algorithm>
#include <vector>

#include "ewa/gaussians.h"
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

/// A region that has some of the splats: the middle half of the means along each axis.
inline pipeline::Region middle_region(const Gaussians& gaussians) {
    pipeline::Region region{};
    for (size_t axis = 0; axis < 3; ++axis) {
        std::vector<float> along;
        for (size_t i = 0; i < gaussians.size(); ++i) along.push_back(gaussians.means[3 * i + axis]);
        std::ranges::sort(along);
        region[axis] = along[along.size() / 4];
        region[3 + axis] = along[along.size() * 3 / 4];
    }
    return region;
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
