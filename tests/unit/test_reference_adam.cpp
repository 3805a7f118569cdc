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

TEST(ReferenceAdam, FirstStepIsTheRateWhateverTheGradient) {
    std::vector<double> values = {1, 1, 1};
    AdamState state(3);
    adam_step(values, std::vector<double>{1e-6, -1e6, 0}, state, 0.25, 1);
    EXPECT_NEAR(values[0], 0.75, 1e-8);
    EXPECT_NEAR(values[1], 1.25, 1e-8);
    EXPECT_EQ(values[2], 1);
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
