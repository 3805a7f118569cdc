// SPDX-License-Identifier: Apache-2.0
// Strategies for splats in portions: the phases of pipeline/strategy.h, one portion after another. What has to pass between
// portions is integers, and copies of splats. All functions are collective.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "pipeline/strategy.h"
#include "portions/portions.h"

namespace ewa::portions {

/// phase.frame: reserved for the largest portion.
pipeline::Refinement densify(Portions& portions, const pipeline::Phase& phase,
                             const pipeline::DensifyRules& rules);
pipeline::Refinement refine_mcmc(Portions& portions, const pipeline::Phase& phase,
                                 const pipeline::McmcRules& rules);
/// Removes all splats but `kept` of the largest weights. The first of equal ones stay. largest: Step::raise_weights.
pipeline::Refinement keep_largest(Portions& portions, const pipeline::Phase& phase,
                                  std::span<const std::vector<float>> largest, uint32_t kept);

}  // namespace ewa::portions
