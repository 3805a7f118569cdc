// SPDX-License-Identifier: Apache-2.0
// The loss against a direct double loop, and its gradient against differences.
#include "reference/loss.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/gradient_check.h"
#include "support/random_scene.h"

namespace ewa::reference {
namespace {

Raster random_raster(uint64_t seed, int width, int height) {
    test::Random random(seed);
    Raster raster = to_double(test::random_target(seed, width, height));
    // Beyond [0, 1] as well: the rendering is not clamped.
    for (double& v : raster.values) v = 1.4 * v - 0.2 + 0.01 * random.normal();
    return raster;
}

/// SSIM of one pixel and channel by the definition: a two-dimensional window over zero padded pictures.
double ssim_at(const Raster& a, const Raster& b, int x, int y, int k) {
    double norm = 0, ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
    for (int dy = -5; dy <= 5; ++dy)
        for (int dx = -5; dx <= 5; ++dx) {
            const double w = std::exp(-(dx * dx + dy * dy) / 4.5);
            norm += w;
            if (x + dx < 0 || y + dy < 0 || x + dx >= a.width || y + dy >= a.height) continue;
            const double p = a.at(x + dx, y + dy)[k], q = b.at(x + dx, y + dy)[k];
            ma += w * p;
            mb += w * q;
            aa += w * p * p;
            bb += w * q * q;
            ab += w * p * q;
        }
    ma /= norm;
    mb /= norm;
    const double saa = aa / norm - ma * ma, sbb = bb / norm - mb * mb, sab = ab / norm - ma * mb;
    return (2 * ma * mb + 1e-4) * (2 * sab + 9e-4) / ((ma * ma + mb * mb + 1e-4) * (saa + sbb + 9e-4));
}

TEST(ReferenceLoss, ValueByTheDefinition) {
    const Raster a = random_raster(1, 19, 8), b = random_raster(2, 19, 8);
    double l1 = 0, ssim = 0;
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 19; ++x)
            for (int k = 0; k < 3; ++k) {
                l1 += std::abs(a.at(x, y)[k] - b.at(x, y)[k]) / (19 * 8 * 3);
                ssim += ssim_at(a, b, x, y, k) / (19 * 8 * 3);
            }
    const Loss loss = image_loss(a, b);
    EXPECT_NEAR(loss.l1, l1, 1e-12);
    EXPECT_NEAR(loss.ssim, ssim, 1e-12);
    EXPECT_NEAR(loss.loss, 0.8 * l1 + 0.2 * (1 - ssim), 1e-12);
}

TEST(ReferenceLoss, EqualPicturesHaveNoLossAndNoGradient) {
    const Raster a = random_raster(3, 13, 17);
    const Loss loss = image_loss(a, a);
    EXPECT_NEAR(loss.loss, 0, 1e-12);
    EXPECT_NEAR(loss.ssim, 1, 1e-12);
    for (double g : loss.gradient.values) EXPECT_NEAR(g, 0, 1e-12);
}

TEST(ReferenceLoss, FlatPicturesAwayFromTheBorder) {
    // Constant pictures p and q: every variance is zero where the window is whole.
    Raster a(31, 31, 3), b(31, 31, 3);
    for (double& v : a.values) v = 0.3;
    for (double& v : b.values) v = 0.6;
    EXPECT_NEAR(ssim_at(a, b, 15, 15, 1), (2 * 0.18 + 1e-4) / (0.09 + 0.36 + 1e-4), 1e-12);
    EXPECT_NEAR(image_loss(a, b).l1, 0.3, 1e-12);
}

TEST(ReferenceLoss, GradientMatchesDifferences) {
    for (uint64_t seed = 10; seed < 13; ++seed) {
        SCOPED_TRACE(test::seed_text(seed));
        const int width = 9 + int(seed % 3) * 6, height = 15;
        Raster a = random_raster(seed, width, height);
        const Raster b = random_raster(seed + 100, width, height);
        const Loss loss = image_loss(a, b);
        std::vector<double> differences;
        for (size_t i = 0; i < a.values.size(); ++i)
            differences.push_back(test::best_central_difference(
                [&] { return image_loss(a, b).loss; }, a.values[i], loss.gradient.values[i], 1e-4, 1e-6));
        EXPECT_TRUE(test::gradients_agree(loss.gradient.values, differences, {1e-10, 1e-6, 1e-5, 1e-6}));
    }
}

TEST(ReferenceLoss, HasTheWeightsOfItsTerms) {
    const LossWeights weights{0.5, 3, 0.25};
    Raster a = random_raster(30, 14, 11);
    const Raster b = random_raster(31, 14, 11);
    const Loss loss = image_loss(a, b, weights), usual = image_loss(a, b);
    double l2 = 0;
    for (size_t i = 0; i < a.values.size(); ++i)
        l2 += (a.values[i] - b.values[i]) * (a.values[i] - b.values[i]) / double(a.values.size());
    EXPECT_NEAR(loss.l2, l2, 1e-12);
    EXPECT_NEAR(loss.loss, 0.5 * usual.l1 + 3 * l2 + 0.25 * (1 - usual.ssim), 1e-12);
    std::vector<double> differences;
    for (size_t i = 0; i < a.values.size(); ++i)
        differences.push_back(test::best_central_difference([&] { return image_loss(a, b, weights).loss; },
                                                            a.values[i], loss.gradient.values[i], 1e-4,
                                                            1e-6));
    EXPECT_TRUE(test::gradients_agree(loss.gradient.values, differences, {1e-10, 1e-6, 1e-5, 1e-6}));
    // A square grows linearly above 16.
    Raster far(1, 1, 3);
    far.values = {0, 20, -40};
    const Loss large = image_loss(far, Raster(1, 1, 3), LossWeights{0, 3, 0});
    EXPECT_NEAR(large.l2, (16 * (40 - 16) + 16 * (80 - 16)) / 3.0, 1e-12);
    EXPECT_EQ(large.gradient.values, (std::vector<double>{0, 32, -32}));
}

TEST(ReferenceLoss, GradientOfMaskedPicturesMatchesDifferences) {
    Raster a = random_raster(20, 15, 12), weights(15, 12, 1);
    const Raster b = random_raster(21, 15, 12);
    for (size_t i = 0; i < weights.values.size(); ++i)
        weights.values[i] = i % 3 == 0 ? 0 : i % 3 == 1 ? 1 : 0.4;
    const Loss loss = image_loss(a, b, weights);
    std::vector<double> differences;
    for (size_t i = 0; i < a.values.size(); ++i)
        differences.push_back(test::best_central_difference([&] { return image_loss(a, b, weights).loss; },
                                                            a.values[i], loss.gradient.values[i], 1e-4,
                                                            1e-6));
    EXPECT_TRUE(test::gradients_agree(loss.gradient.values, differences, {1e-10, 1e-6, 1e-5, 1e-6}));
    for (double& weight : weights.values) weight = 1;
    EXPECT_EQ(image_loss(a, b, weights).loss, image_loss(a, b).loss);
    for (double& weight : weights.values) weight = 0;
    EXPECT_NEAR(image_loss(a, b, weights).loss, 0, 1e-12);
}

TEST(ReferenceLoss, WindowAddsUpToOneAndIsSymmetric) {
    const std::vector<double> window = ssim_window();
    ASSERT_EQ(window.size(), 11u);
    double sum = 0;
    for (size_t k = 0; k < 11; ++k) {
        sum += window[k];
        EXPECT_EQ(window[k], window[10 - k]);
    }
    EXPECT_NEAR(sum, 1, 1e-15);
    EXPECT_NEAR(window[8] / window[5], std::exp(-2.0), 1e-12);
}

}  // namespace
}  // namespace ewa::reference
