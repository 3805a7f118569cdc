// SPDX-License-Identifier: Apache-2.0
// The CPU reference of 3DGS-MCMC against the properties that its formulas promise.
#include "reference/training.h"

#include <gtest/gtest.h>

#include <cmath>

namespace ewa::reference {
namespace {

TEST(Share, OfOneIsTheSplatItself) {
    for (const double o : {0.001, 0.3, 0.99}) {
        EXPECT_NEAR(share_of(o, 1).opacity, o, 1e-15);
        EXPECT_NEAR(share_of(o, 1).scale_factor, 1, 1e-14);
    }
}

/// What eq. 9 is derived from: stacked, the parts are as opaque as the whole at the centre, and the
/// transmitted light summed along a line through the centre is the whole's.
TEST(Share, KeepsThePeakAndTheIntegralAlongALine) {
    for (const double o : {0.05, 0.5, 0.95})
        for (const int parts : {2, 3, 7, 15, 52, 1000, 100000}) {
            const Share share = share_of(o, parts);
            EXPECT_NEAR(-std::expm1(parts * std::log1p(-share.opacity)), o, 1e-12);
            double whole = 0, together = 0;
            for (double x = -9; x < 9; x += 0.01) {
                const double y = x / share.scale_factor;
                whole += o * std::exp(-x * x / 2);
                together += 1 - std::pow(1 - share.opacity * std::exp(-y * y / 2), parts);
            }
            EXPECT_NEAR(together / whole, 1, 1e-6) << o << " in " << parts;
        }
}

TEST(DrawSources, LooksRandomNumbersUpInTheRunningSum) {
    const std::vector<uint32_t> weights{0, 2, 0, 1, 5, 0};
    std::vector<uint32_t> random;
    for (uint32_t eighth = 0; eighth < 8; ++eighth) random.push_back(eighth << 29);
    random.push_back(0xffffffffu);
    EXPECT_EQ(draw_sources(weights, random), (std::vector<uint32_t>{1, 1, 3, 4, 4, 4, 4, 4, 4}));
}

TEST(Noise, HasTheShapeOfTheSplatAndFadesWithOpacity) {
    Splat splat;
    splat.quaternion = {std::sqrt(0.5), 0, 0, std::sqrt(0.5)};  // x turns to y
    splat.log_scale = {std::log(2.0), std::log(1.0), std::log(0.1)};
    splat.opacity_logit = std::log(0.005 / 0.995);  // the gate is half open
    const glm::dvec3 moved = noise(splat, {1, 1, 1}, 0.5);
    EXPECT_NEAR(moved.x, 0.25 * 1, 1e-12);
    EXPECT_NEAR(moved.y, 0.25 * 4, 1e-12);
    EXPECT_NEAR(moved.z, 0.25 * 0.01, 1e-12);
    splat.opacity_logit = 0;
    EXPECT_LT(noise(splat, {1, 1, 1}, 0.5).y, 1e-15);
}

}  // namespace
}  // namespace ewa::reference
