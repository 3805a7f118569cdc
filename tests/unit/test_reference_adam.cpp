// SPDX-License-Identifier: Apache-2.0
// Adam against the recurrence written out for one number.
#include "reference/training.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/random_scene.h"

namespace ewa::reference {
namespace {

TEST(ReferenceAdam, MatchesTheRecurrence) {
    test::Random random(5);
    double x = 0.7, m = 0, v = 0;
    std::vector<double> values = {0.7};
    AdamState state(1);
    for (int t = 1; t <= 50; ++t) {
        const double g = random.normal() * 1e-3;
        m = 0.9 * m + 0.1 * g;
        v = 0.999 * v + 0.001 * g * g;
        const double mean = m / (1 - std::pow(0.9, t)), square = v / (1 - std::pow(0.999, t));
        x -= 0.01 * mean / (std::sqrt(square) + 1e-15);
        EXPECT_EQ(adam_step(values, std::vector<double>{g}, state, 0.01, t), 0u);
        EXPECT_NEAR(values[0], x, 1e-12);
    }
}

/// Dozat's form with a constant decay, whose products of decays are powers.
TEST(ReferenceAdam, NesterovLooksAStepAhead) {
    test::Random random(6);
    double x = -0.3, m = 0, v = 0;
    std::vector<double> values = {x};
    AdamState state(1);
    for (int t = 1; t <= 50; ++t) {
        const double g = 0.2 + random.normal();
        m = 0.9 * m + 0.1 * g;
        v = 0.999 * v + 0.001 * g * g;
        const double now = g / (1 - std::pow(0.9, t)), next = m / (1 - std::pow(0.9, t + 1));
        x -= 0.01 * (0.1 * now + 0.9 * next) / std::sqrt(v / (1 - std::pow(0.999, t)));
        EXPECT_EQ(adam_step(values, std::vector<double>{g}, state, 0.01, t, true), 0u);
        EXPECT_NEAR(values[0], x, 1e-12);
    }
}

TEST(ReferenceAdam, FirstStepIsTheRateWhateverTheGradient) {
    std::vector<double> values = {1, 1, 1};
    AdamState state(3);
    adam_step(values, std::vector<double>{1e-6, -1e6, 0}, state, 0.25, 1);
    EXPECT_NEAR(values[0], 0.75, 1e-8);
    EXPECT_NEAR(values[1], 1.25, 1e-8);
    EXPECT_EQ(values[2], 1);
}

/// Float32 numbers over the whole range of moments.
std::vector<float> spread_values() {
    test::Random random(6);
    std::vector<float> values;
    for (int i = 0; i < 4000; ++i)
        values.push_back(float(std::ldexp(random.uniform(1, 2), int(random.integer(-120, 119)))));
    return values;
}

TEST(PackedMoments, AreWithinTheFormatsBounds) {
    test::Random random(7);
    for (const float value : spread_values()) {
        const double sign = random.bits() % 2 ? -1 : 1;
        const AdamMoments back =
            unpacked_moments(packed_moments(sign * value, value, uint32_t(random.bits())));
        EXPECT_LT(std::abs(back.first - sign * value), std::ldexp(value, -7)) << value;
        const double root = std::sqrt(double(value));
        EXPECT_LE(std::abs(std::sqrt(back.second) - root), std::ldexp(root, -9) * (1 + 1e-6)) << value;
    }
}

TEST(PackedMoments, KeepWhatTheyCanHoldExactly) {
    for (const uint32_t random : {0u, 0x5a5a5a5au, ~0u}) {
        EXPECT_EQ(packed_moments(0, 0, random), 0u);
        for (const double value : {1.0, -1.5, 127.0 / 128, -std::ldexp(3, 50), std::ldexp(1, -126)}) {
            const AdamMoments back = unpacked_moments(packed_moments(value, value * value, random));
            EXPECT_EQ(back.first, value);
            if (std::abs(value) > 1e-18) {
                EXPECT_EQ(back.second, value * value);
            }
        }
        // A root below 2^-63 is none.
        EXPECT_EQ(unpacked_moments(packed_moments(0, std::ldexp(0.99, -126), random)).second, 0);
    }
    EXPECT_EQ(unpacked_moments(0).first, 0);
    EXPECT_EQ(unpacked_moments(0).second, 0);
}

/// The mean over all random bits is the value: rounding pulls a moment nowhere.
TEST(PackedMoments, AreExactOnAverage) {
    for (const double value : {1.0 + 1.0 / 300, 1.9999, 0.7712345, 3e-12}) {
        double first = 0, root = 0;
        constexpr uint32_t kTries = 1u << 14;
        for (uint32_t i = 0; i < kTries; ++i) {
            const AdamMoments back = unpacked_moments(packed_moments(
                double(float(-value)), double(float(value)) * value, i << 18 | (i << 2 & 0xffffu)));
            first += back.first / kTries;
            root += std::sqrt(back.second) / kTries;
        }
        EXPECT_NEAR(first, -value, value * 2e-6);
        EXPECT_NEAR(root, value, value * 1e-6);
    }
}

TEST(ReferenceAdam, NotFiniteIsDroppedAndCounted) {
    std::vector<double> values = {1, 2, 3, 4};
    AdamState state(4);
    const double inf = std::numeric_limits<double>::infinity();
    EXPECT_EQ(adam_step(values, std::vector<double>{std::nan(""), inf, -inf, 1}, state, 0.1, 1), 3u);
    EXPECT_EQ(values[0], 1);
    EXPECT_EQ(values[1], 2);
    EXPECT_EQ(values[2], 3);
    EXPECT_NEAR(values[3], 3.9, 1e-12);
    EXPECT_EQ(state.m[0], 0);
    EXPECT_EQ(state.v[1], 0);
    // Finite, but its square is not: v would be stuck at infinity and the value never move again.
    EXPECT_EQ(adam_step(values, std::vector<double>{1e200, 0, 0, 0}, state, 0.1, 2), 1u);
    EXPECT_EQ(state.v[0], 0);
    EXPECT_EQ(state.m[0], 0);
}

}  // namespace
}  // namespace ewa::reference
