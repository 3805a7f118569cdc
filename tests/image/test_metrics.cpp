// SPDX-License-Identifier: Apache-2.0
// Metrics beside PSNR and SSIM: what holds for any images. python/tests/test_figures.py compares their values with those of other
// implementations.
#include "ewa/metrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "image/metric.h"
#include "image/pillow.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using test::expect_error;

Image grain(int width, int height, int channels, unsigned seed) {
    Image image(width, height, channels);
    std::mt19937 generator(seed);
    std::uniform_real_distribution<float> uniform(0.05f, 0.95f);
    for (float& v : image.pixels) v = uniform(generator);
    return image;
}

Meter every_metric() {
    return Meter(metrics_named("all"));
}

TEST(Metrics, OfEqualImagesAreTheBest) {
    const Image image = grain(181, 177, 3, 1);
    for (const Figure& figure : every_metric().measure(image, image)) {
        if (figure.name.find("psnr") != std::string::npos)
            EXPECT_GT(figure.value, figure.name.starts_with("cc") ? 100 : 1e9) << figure.name;
        else
            EXPECT_NEAR(figure.value, figure.name == "flip" ? 0 : 1, 1e-6) << figure.name;
    }
}

TEST(Metrics, NoPixelOfWeightZeroCounts) {
    const Image reference = grain(190, 180, 3, 2);
    Image image = reference, weights(190, 180, 1);
    for (float& v : image.pixels) v = 0.8f * v + 0.1f;
    for (int y = 0; y < weights.height; ++y)
        for (int x = 0; x < weights.width; ++x) *weights.at(x, y) = x < 70 && y > 20 ? 0.0f : 1.0f;
    const std::vector<Figure> figures = every_metric().measure(image, reference, weights);
    Image other = image;
    for (int y = 0; y < weights.height; ++y)
        for (int x = 0; x < weights.width; ++x)
            if (*weights.at(x, y) == 0) std::fill_n(other.at(x, y), 3, 1.0f);
    const std::vector<Figure> same = every_metric().measure(other, reference, weights);
    const std::vector<Figure> unweighted = every_metric().measure(other, reference);
    for (size_t i = 0; i < figures.size(); ++i) {
        EXPECT_EQ(figures[i].value, same[i].value) << figures[i].name;
        EXPECT_NE(figures[i].value, unweighted[i].value) << figures[i].name;
    }
    for (float& weight : weights.pixels) weight = 0;
    for (const Figure& figure : every_metric().measure(image, reference, weights))
        EXPECT_TRUE(std::isnan(figure.value)) << figure.name;
}

TEST(Metrics, EqualWeightsAreNone) {
    const Image image = grain(178, 180, 4, 3), reference = grain(178, 180, 3, 4);
    Image weights(178, 180, 1);
    for (float& weight : weights.pixels) weight = 1;
    const auto plain = every_metric().measure(image, reference);
    const auto weighted = every_metric().measure(image, reference, weights);
    for (size_t i = 0; i < plain.size(); ++i)
        EXPECT_NEAR(plain[i].value, weighted[i].value, 1e-9) << plain[i].name;
}

TEST(Metrics, TheSameBytesEachTime) {
    const Image image = grain(200, 180, 3, 5), reference = grain(200, 180, 3, 6);
    const auto first = every_metric().measure(image, reference);
    for (int i = 0; i < 3; ++i) {
        const auto again = every_metric().measure(image, reference);
        for (size_t k = 0; k < first.size(); ++k) EXPECT_EQ(first[k].value, again[k].value) << first[k].name;
    }
}

TEST(Metrics, ColourCorrectionUndoesAnAffineChange) {
    const Image reference = grain(40, 30, 3, 7);
    Image image = reference;
    for (size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = (0.5f + 0.1f * float(i % 3)) * image.pixels[i] + 0.05f;
    for (const Figure& figure :
         Meter({"cc_psnr", "cc_ssim", "cc2_psnr", "cc2_ssim"}).measure(image, reference))
        EXPECT_GT(figure.value, figure.name.ends_with("psnr") ? 90 : 0.99999) << figure.name;
}

/// A render that knows little is fitted to nearly the mean of the reference, and never farther from it than before.
TEST(Metrics, ColoursFittedToTheReferenceAreNotWorse) {
    const Image reference = grain(40, 30, 3, 7), other = grain(40, 30, 3, 8);
    Image mean = reference, changed = reference, weights(40, 30, 1);
    std::array<double, 3> sums{};
    for (size_t i = 0; i < reference.pixels.size(); ++i)
        sums[i % 3] += double(reference.pixels[i]) / (40 * 30);
    for (size_t i = 0; i < reference.pixels.size(); ++i) {
        mean.pixels[i] = float(sums[i % 3]);
        changed.pixels[i] = 0.6f * reference.pixels[i] + 0.1f * float(i % 3);
    }
    const auto fitted = [&](const Image& image, const Image& by = {}) {
        return Meter({"fitted_psnr"}).measure(image, reference, by)[0].value;
    };
    EXPECT_GT(fitted(changed), 90);
    EXPECT_GE(fitted(other), psnr(other, reference));
    EXPECT_NEAR(fitted(other), psnr(mean, reference), 0.5);
    EXPECT_NEAR(fitted(mean), psnr(mean, reference), 1e-6);
    // What has no weight is not fitted.
    for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 40; ++x) {
            *weights.at(x, y) = x < 20 ? 1 : 0;
            if (x >= 20) std::copy_n(other.at(x, y), 3, changed.at(x, y));
        }
    EXPECT_GT(fitted(changed, weights), 90);
}

TEST(Metrics, OfSmallImagesAreNotComputedWhereTheWindowDoesNotFit) {
    const auto figures =
        Meter({"ssim_valid", "ms_ssim", "flip"}).measure(grain(10, 175, 3, 8), grain(10, 175, 3, 9));
    EXPECT_TRUE(std::isnan(figures[0].value));
    EXPECT_TRUE(std::isnan(figures[1].value));
    EXPECT_GT(figures[2].value, 0);
}

TEST(Metrics, AreNamedInLists) {
    EXPECT_EQ(metrics_named("flip,cc_psnr,flip"), (std::vector<std::string>{"cc_psnr", "flip"}));
    EXPECT_EQ(metrics_named("bands").size(), 5u);
    EXPECT_EQ(metrics_named("all").size(), all_metrics().size());
    expect_error<InputError>([] { metrics_named("flop"); }, {"flop", "did you mean flip?"});
    expect_error<InputError>([] { metrics_named(""); }, {"''"});
    expect_error<InputError>([] { Meter({"flip"}).measure(grain(4, 5, 3, 1), grain(5, 4, 3, 1)); },
                             {"4 x 5"});
}

/// Of an edge, a box of 11 px leaves an eleventh of the step between its pixels. A ramp has nothing that it could lose.
TEST(BlurEffect, IsWhatABoxLeavesOfTheDifferences) {
    Image edge(40, 30, 3), ramp(40, 30, 3), steps(40, 30, 1);
    for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 40; ++x) {
            std::fill_n(edge.at(x, y), 3, x < 20 ? 0.2f : 0.7f);
            std::fill_n(ramp.at(x, y), 3, float(x) / 64);
            *steps.at(x, y) = x < 20 ? 0 : x < 22 ? 0.5f : 1;
        }
    EXPECT_NEAR(image::blur_effect(edge), 1 / 11.0, 1e-6);
    // At both ends it lacks 5/11, 4/11, ... of a difference.
    EXPECT_NEAR(image::blur_effect(ramp), 1 - 2 * 15 / 11.0 / 39, 1e-5);
    EXPECT_NEAR(image::blur_effect(steps), 2 / 11.0, 1e-6);
    EXPECT_EQ(image::blur_effect(Image(9, 9, 3)), 0);
}

TEST(Pillow, AHalvedRampStaysOne) {
    Image ramp(64, 2, 3);
    for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 64; ++x) std::fill_n(ramp.at(x, y), 3, float(2 * x) / 255);
    const Image half = image::resized_as_pillow(ramp, 32, 1);
    ASSERT_EQ(half.height, 1);
    for (int x = 4; x < 28; ++x) EXPECT_EQ(*half.at(x, 0), float(4 * x + 1) / 255) << x;
    EXPECT_EQ(image::resized_as_pillow(ramp, 64, 2).pixels, ramp.pixels);
}

}  // namespace
