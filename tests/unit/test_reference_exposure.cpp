// SPDX-License-Identifier: Apache-2.0
// The exposure's gradient against differences.
#include "reference/loss.h"

#include <gtest/gtest.h>
#include <algorithm>

#include "ewa/appearance.h"
#include "support/random_scene.h"

namespace ewa::reference {
namespace {

struct ExposureCase {
    Raster image, weights;  // L = sum weights * exposed image
    Exposure exposure{};

    ExposureCase() : image(to_double(test::random_target(5, 7, 4))), weights(7, 4, 3) {
        test::Random random(6);
        for (double& w : weights.values) w = random.normal();
        for (double& e : exposure) e = random.normal();
    }
    double value() const {
        const Raster out = exposed(image, exposure);
        double sum = 0;
        for (size_t i = 0; i < out.values.size(); ++i) sum += weights.values[i] * out.values[i];
        return sum;
    }
};

// The map is linear in either argument: a difference is exact but for rounding.
TEST(ReferenceExposure, GradientIsTheDifference) {
    ExposureCase c;
    const ExposureGradient gradient = exposed_backward(c.image, c.exposure, c.weights);
    const double before = c.value();
    for (size_t k = 0; k < 12; ++k) {
        ExposureCase moved = c;
        moved.exposure[k] += 1;
        EXPECT_NEAR(moved.value() - before, gradient.exposure[k], 1e-10) << k;
    }
    for (size_t i = 0; i < c.image.values.size(); i += 5) {
        ExposureCase moved = c;
        moved.image.values[i] += 1;
        EXPECT_NEAR(moved.value() - before, gradient.image.values[i], 1e-10) << i;
    }
}

TEST(ReferenceExposure, MatchesTheExposureOfAnImage) {
    const Image image = test::random_target(8, 6, 5);
    ewa::Exposure e{0.5f, 0.1f, 0, 0.2f, 0, 2, 0, -0.1f, 0.3f, 0, 1, 0};
    Exposure wide;
    std::copy(e.begin(), e.end(), wide.begin());
    const Image actual = with_appearance(image, e);
    const Raster expected = exposed(to_double(image), wide);
    for (int y = 0; y < 5; ++y)
        for (int x = 0; x < 6; ++x)
            for (int c = 0; c < 3; ++c) EXPECT_NEAR(actual.at(x, y)[c], expected.at(x, y)[c], 1e-6);
    EXPECT_EQ(with_appearance(image, kIdentityExposure).pixels, image.pixels);
}

}  // namespace
}  // namespace ewa::reference
