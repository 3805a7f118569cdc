// SPDX-License-Identifier: Apache-2.0
#include "reference/harmonics.h"

#include <algorithm>
#include <glm/geometric.hpp>

#include "reference/projection.h"
#include "scene/color.h"

namespace ewa::reference {

using namespace shared;

namespace {

glm::dvec3 unit_of(const glm::dvec3& direction) {
    const double norm = glm::length(direction);
    return norm > 0 ? direction / norm : glm::dvec3(0);
}

std::array<glm::dvec3, 25> harmonics_basis_gradient(int degree, const glm::dvec3& d) {
    std::array<glm::dvec3, 25> out{};
    const auto low = sh_basis_gradient(degree, d);
    std::copy(low.begin(), low.end(), out.begin());
    if (degree < 4) return out;
    const double x = d.x, y = d.y, z = d.z, xx = x * x, yy = y * y, zz = z * z, xyz = x * y * z;
    out[16] = SH_C4_0 * glm::dvec3(y * (3 * xx - yy), x * (xx - 3 * yy), 0);
    out[17] = SH_C4_1 * glm::dvec3(6 * xyz, 3 * z * (xx - yy), y * (3 * xx - yy));
    out[18] = SH_C4_2 * glm::dvec3(y * (7 * zz - 1), x * (7 * zz - 1), 14 * xyz);
    out[19] = SH_C4_3 * glm::dvec3(0, z * (7 * zz - 3), y * (21 * zz - 3));
    out[20] = SH_C4_4 * glm::dvec3(0, 0, 20 * z * (7 * zz - 3));
    out[21] = SH_C4_5 * glm::dvec3(z * (7 * zz - 3), 0, x * (21 * zz - 3));
    out[22] = SH_C4_6 * glm::dvec3(2 * x * (7 * zz - 1), -2 * y * (7 * zz - 1), 14 * z * (xx - yy));
    out[23] = SH_C4_7 * glm::dvec3(3 * z * (xx - yy), -6 * xyz, x * (xx - 3 * yy));
    out[24] = SH_C4_8 * glm::dvec3(4 * x * (xx - 3 * yy), 4 * y * (yy - 3 * xx), 0);
    return out;
}

}  // namespace

std::array<double, 25> harmonics_basis(int degree, const glm::dvec3& d) {
    std::array<double, 25> out{};
    const auto low = sh_basis(degree, d);
    std::copy(low.begin(), low.end(), out.begin());
    if (degree < 4) return out;
    const double x = d.x, y = d.y, z = d.z, xx = x * x, yy = y * y, zz = z * z;
    const double one = glm::dot(d, d);  // 0 for no direction
    out[16] = SH_C4_0 * x * y * (xx - yy);
    out[17] = SH_C4_1 * y * z * (3 * xx - yy);
    out[18] = SH_C4_2 * x * y * (7 * zz - 1);
    out[19] = SH_C4_3 * y * z * (7 * zz - 3);
    out[20] = SH_C4_4 * (zz * (35 * zz - 30) + 3 * one);
    out[21] = SH_C4_5 * x * z * (7 * zz - 3);
    out[22] = SH_C4_6 * (xx - yy) * (7 * zz - 1);
    out[23] = SH_C4_7 * x * z * (xx - 3 * yy);
    out[24] = SH_C4_8 * (xx * (xx - 3 * yy) - yy * (3 * xx - yy));
    return out;
}

std::vector<double> harmonics(int degree, const glm::dvec3& direction,
                              const std::vector<double>& coefficients, size_t channels) {
    const auto basis = harmonics_basis(degree, unit_of(direction));
    std::vector<double> colors(channels);
    for (size_t k = 0; k < size_t(degree + 1) * size_t(degree + 1); ++k)
        for (size_t c = 0; c < channels; ++c) colors[c] += basis[k] * coefficients[k * channels + c];
    return colors;
}

HarmonicsGradient harmonics_backward(int degree, const glm::dvec3& direction,
                                     const std::vector<double>& coefficients,
                                     const std::vector<double>& by_colors) {
    const size_t channels = by_colors.size();
    const glm::dvec3 unit = unit_of(direction);
    const auto basis = harmonics_basis(degree, unit);
    const auto slope = harmonics_basis_gradient(degree, unit);
    HarmonicsGradient out;
    out.coefficients.resize(coefficients.size());
    glm::dvec3 by_unit(0);
    for (size_t k = 0; k < size_t(degree + 1) * size_t(degree + 1); ++k)
        for (size_t c = 0; c < channels; ++c) {
            out.coefficients[k * channels + c] = basis[k] * by_colors[c];
            by_unit += coefficients[k * channels + c] * by_colors[c] * slope[k];
        }
    if (unit != glm::dvec3(0))
        out.direction = (by_unit - unit * glm::dot(unit, by_unit)) / glm::length(direction);
    return out;
}

}  // namespace ewa::reference
