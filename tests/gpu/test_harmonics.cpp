// SPDX-License-Identifier: Apache-2.0
// The operators of spherical harmonics against the CPU reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "ewa/error.h"
#include "ewa/operators.h"
#include "gpu/test_device.h"
#include "reference/harmonics.h"
#include "support/random_scene.h"

namespace ewa::test {
namespace {

inline SharedByTests<Operators>* const harmonics_of_all = SharedByTests<Operators>::add();
Operators& harmonics_operators() {
    return harmonics_of_all->get([] { return Operators(device()); });
}

struct HarmonicsCase {
    uint32_t degree, count, channels;
    size_t splats, views;
    bool masked;
};

class HarmonicsPass : public testing::TestWithParam<HarmonicsCase> {
  protected:
    HarmonicsPass() : c(GetParam()), random(40 + c.degree) {
        for (size_t k = 0; k < 3 * pairs(); ++k) directions.push_back(float(random.normal()));
        for (size_t k = 0; k < c.splats * c.count * c.channels; ++k)
            coefficients.push_back(float(random.normal()));
        for (size_t k = 0; k < pairs() * c.channels; ++k) by_colors.push_back(float(random.normal()));
        if (c.masked)
            for (size_t k = 0; k < pairs(); ++k) masks.push_back(uint8_t(random.integer(0, 2)));
    }
    size_t pairs() const { return c.splats * c.views; }
    HarmonicsArrays arrays() const {
        return {c.degree, c.count, c.channels, directions, coefficients, masks};
    }
    bool shown(size_t at) const { return masks.empty() || masks[at]; }
    glm::dvec3 direction(size_t at) const {
        return {directions[3 * at], directions[3 * at + 1], directions[3 * at + 2]};
    }
    std::vector<double> own(const std::vector<float>& values, size_t i) const {
        const size_t width = values.size() / (&values == &coefficients ? c.splats : pairs());
        return {values.begin() + long(i * width), values.begin() + long((i + 1) * width)};
    }
    HarmonicsCase c;
    Random random;
    std::vector<float> directions, coefficients, by_colors;
    std::vector<uint8_t> masks;
};

TEST_P(HarmonicsPass, ColorsMatchTheReference) {
    const std::vector<float> colors = harmonics_operators().spherical_harmonics(arrays());
    ASSERT_EQ(colors.size(), pairs() * c.channels);
    double worst = 0;
    for (size_t at = 0; at < pairs(); ++at) {
        const auto expected =
            reference::harmonics(int(c.degree), direction(at), own(coefficients, at % c.splats), c.channels);
        for (size_t k = 0; k < c.channels; ++k) {
            const float actual = colors[at * c.channels + k];
            worst = std::max(worst, shown(at) ? std::abs(actual - expected[k]) : double(std::abs(actual)));
        }
    }
    printf("    worst %.1e\n", worst);
    EXPECT_LT(worst, 5e-6);
}

TEST_P(HarmonicsPass, GradientsMatchTheReference) {
    const HarmonicsGradient actual =
        harmonics_operators().spherical_harmonics_backward(arrays(), by_colors, true);
    std::vector<double> by_coefficients(coefficients.size());
    ASSERT_EQ(actual.directions.size(), 3 * pairs());
    double worst_direction = 0, worst = 0;
    for (size_t at = 0; at < pairs(); ++at) {
        auto g = reference::harmonics_backward(int(c.degree), direction(at), own(coefficients, at % c.splats),
                                               own(by_colors, at));
        if (!shown(at)) g.direction = glm::dvec3(0);
        for (size_t k = 0; k < 3; ++k)
            worst_direction =
                std::max(worst_direction, std::abs(actual.directions[3 * at + k] - g.direction[int(k)]) *
                                              glm::length(direction(at)));
        for (size_t k = 0; k < g.coefficients.size() && shown(at); ++k)
            by_coefficients[(at % c.splats) * g.coefficients.size() + k] += g.coefficients[k];
    }
    ASSERT_EQ(actual.coefficients.size(), by_coefficients.size());
    for (size_t k = 0; k < by_coefficients.size(); ++k)
        worst = std::max(worst, std::abs(actual.coefficients[k] - by_coefficients[k]));
    printf("    directions %.1e, coefficients %.1e\n", worst_direction, worst);
    EXPECT_LT(worst_direction, 2e-4);  // sums of up to 25 * 7 terms
    EXPECT_LT(worst, 5e-6);
    const HarmonicsGradient without =
        harmonics_operators().spherical_harmonics_backward(arrays(), by_colors, false);
    EXPECT_EQ(without.coefficients, actual.coefficients);
    EXPECT_TRUE(without.directions.empty());
}

INSTANTIATE_TEST_SUITE_P(
    All, HarmonicsPass,
    testing::Values(HarmonicsCase{0, 1, 3, 300, 1, false}, HarmonicsCase{1, 4, 1, 100, 2, true},
                    HarmonicsCase{2, 16, 3, 129, 3, false}, HarmonicsCase{3, 16, 3, 300, 2, true},
                    HarmonicsCase{4, 25, 7, 200, 1, false}, HarmonicsCase{4, 27, 4, 33, 3, true},
                    HarmonicsCase{3, 16, 5, 1, 1, false}));

}  // namespace
}  // namespace ewa::test
