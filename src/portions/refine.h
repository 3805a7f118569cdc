// SPDX-License-Identifier: Apache-2.0
// Changes the number of splats in portions: runs the phases of pipeline/strategy.h on one portion after another. Portions exchange
// only integers and copies of splats. All functions are collective.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "pipeline/strategy.h"
#include "portions/portions.h"

namespace ewa::portions {

/// Refine by adc and by mcmc. phase.frame: reserved for the largest portion.
pipeline::Refinement densify(Portions& portions, const pipeline::Phase& phase,
                             const pipeline::DensifyRules& rules);
pipeline::Refinement refine_mcmc(Portions& portions, const pipeline::Phase& phase,
                                 const pipeline::McmcRules& rules);
/// Removes all splats but the `kept` ones with the largest weights. Among equal weights, the first splats stay. largest: the
/// weights from Step::raise_weights.
pipeline::Refinement keep_largest(Portions& portions, const pipeline::Phase& phase,
                                  std::span<const std::vector<float>> largest, uint32_t kept);

}  // namespace ewa::portions
