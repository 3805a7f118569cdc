// SPDX-License-Identifier: Apache-2.0
#include "reference/mcmc.h"

#include <cassert>
#include <cmath>
#include <numbers>

#include "reference/projection.h"
#include "shared/constants.h"

namespace ewa::reference {

Share share_of(double opacity, int parts) {
    assert(parts >= 1);
    const double x = -std::expm1(std::log1p(-opacity) / parts);
    // The sum cancels beyond float64 too; as an integral (shaders/lib/mcmc.glsl) it does not.
    if (parts > 20) {
        double integral = 0;
        for (int j = 0; j < 512; ++j) {
            const double t = j / 64.0;
            integral -= (j == 0 ? 0.5 : 1) * std::expm1(parts * std::log1p(-x * std::exp(-t * t))) / 64.0;
        }
        return {x, opacity / (2 / std::sqrt(std::numbers::pi) * integral)};
    }
    double sum = 0;
    for (int i = 1; i <= parts; ++i) {
        double binomial = 1;  // C(i - 1, k)
        for (int k = 0; k < i; ++k) {
            sum += binomial * (k % 2 == 0 ? 1 : -1) * std::pow(x, k + 1) / std::sqrt(k + 1.0);
            binomial *= double(i - 1 - k) / (k + 1);
        }
    }
    return {x, opacity / sum};
}

std::vector<uint32_t> draw_sources(std::span<const uint32_t> weights, std::span<const uint32_t> random) {
    uint64_t total = 0;
    for (const uint32_t w : weights) total += w;
    std::vector<uint32_t> sources;
    for (const uint32_t r : random) {
        uint64_t target = uint64_t(r) * total >> 32;
        uint32_t e = 0;
        while (target >= weights[e]) target -= weights[e++];
        sources.push_back(e);
    }
    return sources;
}

glm::dvec3 noise(const Splat& splat, const glm::dvec3& normal, double amplitude) {
    const double norm = robust_norm(splat.quaternion);
    std::array<double, 4> unit{};
    for (int k = 0; k < 4; ++k) unit[size_t(k)] = splat.quaternion[size_t(k)] / norm;
    const glm::dmat3 rotation = rotation_matrix(unit);
    glm::dvec3 along = normal * rotation;
    for (int k = 0; k < 3; ++k) along[k] *= std::exp(2 * splat.log_scale[k]);
    const double opacity = 1 / (1 + std::exp(-splat.opacity_logit));
    const double gate = 1 / (1 + std::exp(shared::MCMC_GATE_SLOPE * (opacity - shared::MCMC_GATE_OPACITY)));
    return amplitude * gate * (rotation * along);
}

glm::dvec3 apart(const Splat& source, const glm::dvec3& normal, double spread) {
    const double norm = robust_norm(source.quaternion);
    std::array<double, 4> unit{};
    for (size_t k = 0; k < 4; ++k) unit[k] = source.quaternion[k] / norm;
    glm::dvec3 step(0);
    for (int k = 0; k < 3; ++k) step[k] = spread * std::exp(source.log_scale[k]) * normal[k];
    return source.mean + rotation_matrix(unit) * step;
}

}  // namespace ewa::reference
