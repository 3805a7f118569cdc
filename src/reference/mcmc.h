// SPDX-License-Identifier: Apache-2.0
// 3DGS as Markov chain Monte Carlo (Kheradmand et al. 2024): what a splat becomes that is shared by several,
// which splats are drawn as sources, and the noise on the means.
#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "reference/values.h"

namespace ewa::reference {

/// Eq. 9: opacity 1 - (1 - o)^(1/N) and the factor of the scales of each of N splats in the place of one of
/// opacity o. Written as the paper's double sum, whose terms cancel, up to N = 20 (to 1e-9), and as an
/// integral beyond.
struct Share {
    double opacity = 0, scale_factor = 1;
};
Share share_of(double opacity, int parts);

/// Source of each draw: the splat in whose stretch of the weights' running sum floor(random * total / 2^32)
/// lies.
std::vector<uint32_t> draw_sources(std::span<const uint32_t> weights, std::span<const uint32_t> random);

/// Where a source or a copy of it stands that moves `spread` of its standard deviations, times a normal draw.
glm::dvec3 apart(const Splat& source, const glm::dvec3& normal, double spread);

/// Eq. 8: amplitude * sigmoid(-MCMC_GATE_SLOPE (opacity - MCMC_GATE_OPACITY)) * Sigma * normal, world units.
glm::dvec3 noise(const Splat& splat, const glm::dvec3& normal, double amplitude);

}  // namespace ewa::reference
