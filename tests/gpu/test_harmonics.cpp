// SPDX-License-Identifier: Apache-2.0
// The operators of spherical harmonics against the CPU reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "ewa/error.h"
#include "ewa/operators.h"
#include "gpu/guarded.h"
#include "passes/passes.h"
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
    // The two kernels are compiled apart: a GPU's compiler may contract sums of one and not of the other.
    const double apart = device()->limits().cpu ? 0 : 1e-6;
    ASSERT_EQ(without.coefficients.size(), actual.coefficients.size());
    for (size_t k = 0; k < actual.coefficients.size(); ++k)
        EXPECT_NEAR(without.coefficients[k], actual.coefficients[k], apart) << k;
    EXPECT_TRUE(without.directions.empty());
}

INSTANTIATE_TEST_SUITE_P(
    All, HarmonicsPass,
    testing::Values(HarmonicsCase{0, 1, 3, 300, 1, false}, HarmonicsCase{1, 4, 1, 100, 2, true},
                    HarmonicsCase{2, 16, 3, 129, 3, false}, HarmonicsCase{3, 16, 3, 300, 2, true},
                    HarmonicsCase{4, 25, 7, 200, 1, false}, HarmonicsCase{4, 27, 4, 33, 3, true},
                    HarmonicsCase{3, 16, 5, 1, 1, false}));

TEST(HarmonicsEdges, DirectionsOfAnyLength) {
    const std::vector<float> coefficients(25, 0.5f);
    const auto color = [&](float x, float y, float z) {
        const std::vector<float> direction = {x, y, z};
        return harmonics_operators().spherical_harmonics({4, 25, 1, direction, coefficients, {}})[0];
    };
    const float expected = color(0.6f, -0.3f, 0.5f);
    EXPECT_NEAR(color(0.6e-25f, -0.3e-25f, 0.5e-25f), expected, 1e-6);
    EXPECT_NEAR(color(0.6e30f, -0.3e30f, 0.5e30f), expected, 2e-6);
    EXPECT_FLOAT_EQ(color(0, 0, 0), float(0.5 * shared::SH_C0)) << "no direction: degree 0 alone";
    const std::vector<float> zero(3), one(1, 1.0f);
    const HarmonicsGradient by =
        harmonics_operators().spherical_harmonics_backward({4, 25, 1, zero, coefficients, {}}, one, true);
    EXPECT_EQ(by.directions, zero);
}

TEST(HarmonicsEdges, WhatIsMaskedMayBeAnything) {
    const float nan = std::nanf("");
    const std::vector<float> directions = {nan, nan, nan, 0, 0, 1, 0, 1, 0},
                             coefficients = {nan, nan, nan, nan, 1, 2, 3, 4, nan, nan, nan, nan};
    const std::vector<uint8_t> masks = {0, 1, 0};
    const HarmonicsArrays arrays = {1, 4, 1, directions, coefficients, masks};
    const std::vector<float> colors = harmonics_operators().spherical_harmonics(arrays);
    EXPECT_EQ(colors[0], 0);
    EXPECT_NEAR(colors[1], shared::SH_C0 + 3 * shared::SH_C1, 1e-5);
    EXPECT_EQ(colors[2], 0);
    const std::vector<float> by_colors = {nan, 1, nan};
    const HarmonicsGradient by = harmonics_operators().spherical_harmonics_backward(arrays, by_colors, true);
    for (const size_t i : {0, 2}) {
        for (size_t k = 0; k < 4; ++k) EXPECT_EQ(by.coefficients[4 * i + k], 0) << k;
        for (size_t k = 0; k < 3; ++k) EXPECT_EQ(by.directions[3 * i + k], 0) << k;
    }
}

TEST(HarmonicsEdges, NothingIsWrittenBehindAnArray) {
    Rig& r = rig();
    const size_t n = 129, c = 2, count = 17, channels = 5;
    const Guarded directions("directions", std::vector<float>(3 * n * c, 0.5f)),
        coefficients("coefficients", std::vector<float>(n * count * channels, 1.0f)), masks("masks", 16);
    const Guarded colors("colors", 4 * n * c * channels),
        by_coefficients("by coefficients", 4 * n * count * channels),
        by_directions("by directions", 12 * n * c);
    const shared::HarmonicsPush push{uint32_t(n), uint32_t(c), uint32_t(count), uint32_t(channels)};
    r.run([&](gpu::Recording& recording) {
        r.cache.get<passes::Harmonics>({{shared::SPEC_SH_DEGREE, 3}, {shared::SPEC_MODE, 0}})
            .record(recording, {directions, coefficients, masks, colors, coefficients}, push);
        r.cache
            .get<passes::HarmonicsBackward>(
                {{shared::SPEC_SH_DEGREE, 3}, {shared::SPEC_MODE, shared::HARMONICS_DIRECTIONS}})
            .record(recording,
                    {directions, coefficients, masks, colors, by_coefficients, by_directions, coefficients},
                    push);
    });
    expect_intact({&colors, &by_coefficients, &by_directions});
    for (const float value : by_coefficients.read<float>()) ASSERT_FALSE(std::isnan(value));
    for (const float value : by_directions.read<float>()) ASSERT_FALSE(std::isnan(value));
}

TEST(HarmonicsEdges, WrongArgumentsAreNamed) {
    const std::vector<float> three(3), four(4), eight(8);
    const std::vector<uint8_t> masks(2);
    const auto expect = [&](const char* text, const HarmonicsArrays& arrays) {
        std::string message = "no error";
        try {
            harmonics_operators().spherical_harmonics(arrays);
        } catch (const InputError& error) {
            message = error.what();
        }
        EXPECT_NE(message.find(text), std::string::npos) << message;
    };
    expect("degree 5", {5, 36, 1, three, four, {}});
    expect("needs 4", {1, 3, 1, three, three, {}});
    expect("0 channels", {0, 1, 0, three, three, {}});
    expect("coefficients has 3 values", {1, 4, 1, three, three, {}});
    expect("directions has 4 values", {1, 4, 1, four, four, {}});
    expect("masks has 2 values", {1, 4, 1, three, four, masks});
    expect("no error", {1, 4, 2, three, eight, {}});
    EXPECT_TRUE(harmonics_operators().spherical_harmonics({1, 4, 2, {}, {}, {}}).empty());
    EXPECT_THROW(harmonics_operators().spherical_harmonics_backward({1, 4, 2, three, eight, {}}, three, true),
                 InputError);
}

}  // namespace
}  // namespace ewa::test
