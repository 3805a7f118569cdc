// SPDX-License-Identifier: Apache-2.0
// The sky's map has no seams, and its gradients are those of differences.
#include "reference/sky.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "ewa/error.h"
#include "support/gradient_check.h"
#include "support/random_sky.h"
#include "support/temp_folder.h"

namespace ewa::reference {
namespace {

glm::dvec3 random_direction(test::Random& random) {
    return glm::normalize(glm::dvec3(random.normal(), random.normal(), random.normal()));
}

TEST(ReferenceSky, HasNoSeams) {
    for (const int size : {1, 2, 5, 8}) {
        const Sky sky(test::random_sky(41, size));
        test::Random random(42);
        for (int k = 0; k < 20000; ++k) {
            glm::dvec3 direction = random_direction(random);
            // Many of them near the planes where the octahedron folds, and near its corner at -z.
            if (k % 4 < 3) direction[k % 4] *= 1e-9;
            if (k % 7 == 0) direction.x *= 1e-9;
            const glm::dvec3 near = direction + 1e-8 * random_direction(random);
            EXPECT_LT(glm::distance(sky_color(sky, direction), sky_color(sky, near)), 1e-5 * size);
        }
    }
}

TEST(ReferenceSky, HasTheColourOfATexelAtItsCentre) {
    const Sky sky(test::random_sky(43, 4));
    const auto expect = [&](const glm::dvec3& direction, size_t column, size_t row) {
        for (size_t c = 0; c < 3; ++c)
            EXPECT_NEAR(sky_color(sky, 7.0 * direction)[int(c)], sky.texels[3 * (4 * row + column) + c],
                        1e-12);
    };
    expect({0.25, 0.25, 0.5}, 2, 2);    // p = (1/4, 1/4)
    expect({-0.25, 0.25, 0.5}, 1, 2);   // p = (-1/4, 1/4)
    expect({0.25, 0.25, -0.5}, 3, 3);   // p = (3/4, 3/4), where the half of -z is folded to
    expect({-0.25, 0.25, -0.5}, 0, 3);  // p = (-3/4, 3/4)
}

TEST(ReferenceSky, GradientsAreDifferences) {
    const Camera camera = test::random_camera(44, 9, 7);
    Sky sky(test::random_sky(45, 4));
    const Raster color = to_double(test::random_target(46, 9, 7)),
                 weights = to_double(test::random_target(47, 9, 7));
    Raster left(9, 7, 1);
    test::Random random(48);
    for (double& value : left.values) value = random.uniform(0, 1);
    const auto value = [&] {
        const Raster out = over_sky(color, left, camera, sky);
        double sum = 0;
        for (size_t i = 0; i < out.values.size(); ++i) sum += weights.values[i] * out.values[i];
        return sum;
    };
    const std::vector<double> gradient = sky_gradient(sky, left, camera, weights);
    const std::vector<double> penalty = sky_penalty_gradient(sky);
    size_t seen = 0;
    for (size_t k = 0; k < gradient.size(); ++k) {
        seen += gradient[k] != 0;
        double& texel = sky.texels[k];
        EXPECT_NEAR(test::best_central_difference(value, texel, gradient[k]), gradient[k], 1e-8);
        EXPECT_NEAR(test::best_central_difference([&] { return sky_penalty(sky); }, texel, penalty[k]),
                    penalty[k], 1e-12);
    }
    EXPECT_GT(seen, 8u);
}

TEST(SkyFile, KeepsEveryBit) {
    const test::TempFolder folder;
    const SkyMap sky = test::random_sky(49, 3);
    save_sky(folder / "sky.json", sky);
    EXPECT_EQ(load_sky(folder / "sky.json"), sky);
}

}  // namespace
}  // namespace ewa::reference
