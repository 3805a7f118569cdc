// SPDX-License-Identifier: Apache-2.0
// Real spherical harmonics to degree 4, of any number of channels: colour_c = sum_k coefficient_kc Y_k(d / |d|). Y_k is that of
// scene/color.h, and of degree 4 that of svox2 (Yu et al. 2021), which continues it.
#pragma once
#include <array>
#include <glm/vec3.hpp>
#include <vector>

namespace ewa::reference {

/// degree: 0 to 4. unit: a unit vector, or zero. Zero above (degree + 1)^2.
std::array<double, 25> harmonics_basis(int degree, const glm::dvec3& unit);

/// direction: of any length; zero counts as a unit vector that is zero. coefficients: [K, channels].
std::vector<double> harmonics(int degree, const glm::dvec3& direction,
                              const std::vector<double>& coefficients, size_t channels);

struct HarmonicsGradient {
    std::vector<double> coefficients;
    glm::dvec3 direction{0};
};
HarmonicsGradient harmonics_backward(int degree, const glm::dvec3& direction,
                                     const std::vector<double>& coefficients,
                                     const std::vector<double>& by_colors);

}  // namespace ewa::reference
