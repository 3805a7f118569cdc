// SPDX-License-Identifier: Apache-2.0
#include "reference/harmonics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "support/gradient_check.h"
#include "support/random_scene.h"

namespace ewa::reference {
namespace {

/// Over the sphere: Gauss-Legendre of 8 points along z and 16 steps round it are exact to degree 15.
TEST(ReferenceHarmonics, BasesAreOrthonormalToDegree4) {
    const double nodes[] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
    const double weights[] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
    double products[25][25] = {};
    for (int node = 0; node < 8; ++node) {
        const double z = node % 2 ? nodes[node / 2] : -nodes[node / 2], r = std::sqrt(1 - z * z);
        for (int step = 0; step < 16; ++step) {
            const double angle = std::numbers::pi / 8 * step;
            const auto b = harmonics_basis(4, {r * std::cos(angle), r * std::sin(angle), z});
            for (size_t j = 0; j < 25; ++j)
                for (size_t k = 0; k < 25; ++k)
                    products[j][k] += weights[node / 2] * std::numbers::pi / 8 * b[j] * b[k];
        }
    }
    for (size_t j = 0; j < 25; ++j)
        for (size_t k = 0; k < 25; ++k) EXPECT_NEAR(products[j][k], j == k, 1e-9) << j << " " << k;
}

TEST(ReferenceHarmonics, GradientMatchesDifferencesForEachDegree) {
    test::Random random(5);
    for (int degree = 0; degree <= 4; ++degree) {
        const size_t channels = degree == 2 ? 1 : 5, count = 25;
        glm::dvec3 direction(random.normal(), random.normal(), random.normal());
        std::vector<double> coefficients(count * channels), by_colors(channels);
        for (double& c : coefficients) c = random.normal();
        for (double& c : by_colors) c = random.normal();
        const auto value = [&] {
            const auto colors = harmonics(degree, direction, coefficients, channels);
            double sum = 0;
            for (size_t c = 0; c < channels; ++c) sum += by_colors[c] * colors[c];
            return sum;
        };
        const HarmonicsGradient g = harmonics_backward(degree, direction, coefficients, by_colors);
        std::vector<double> differences;
        for (int k = 0; k < 3; ++k)
            differences.push_back(test::best_central_difference(value, direction[k], g.direction[k]));
        EXPECT_TRUE(
            test::gradients_agree(std::vector{g.direction.x, g.direction.y, g.direction.z}, differences))
            << degree;
        differences.clear();
        for (size_t k = 0; k < coefficients.size(); ++k)
            differences.push_back(test::best_central_difference(value, coefficients[k], g.coefficients[k]));
        EXPECT_TRUE(test::gradients_agree(g.coefficients, differences)) << degree;
    }
}

}  // namespace
}  // namespace ewa::reference
