// SPDX-License-Identifier: Apache-2.0
// The helpers that judge gradients must themselves fail on wrong input.
#include "support/gradient_check.h"

#include <cmath>
#include <limits>

#include "ewa/gaussians.h"

namespace ewa::test {
namespace {

const std::vector<double> kRight = {1, -2, 3, 0.5, 0, 1e-3};

TEST(GradientCheck, AcceptsEqualAndNearlyEqual) {
    EXPECT_TRUE(gradients_agree(kRight, kRight));
    std::vector<double> near = kRight;
    for (double& v : near) v *= 1 + 1e-5;
    EXPECT_TRUE(gradients_agree(near, kRight));
    EXPECT_TRUE(gradients_agree(std::vector<double>(4, 0.0), std::vector<double>(4, 0.0)));
    EXPECT_TRUE(gradients_agree(std::vector<double>{}, std::vector<double>{}));
}

TEST(GradientCheck, OneSideZeroFails) {
    const std::vector<double> zero(kRight.size(), 0.0);
    EXPECT_FALSE(gradients_agree(zero, kRight));
    EXPECT_FALSE(gradients_agree(kRight, zero));
    // Also where both are far below one.
    const std::vector<double> tiny(kRight.size(), 1e-200);
    EXPECT_FALSE(gradients_agree(zero, tiny));
    EXPECT_FALSE(gradients_agree(tiny, zero));
}

TEST(GradientCheck, WrongDirectionFails) {
    std::vector<double> flipped = kRight;
    flipped[3] = -flipped[3];
    const GradientTolerance direction_only{1e-6, 1e9, 1e9, 1e9};
    EXPECT_FALSE(gradients_agree(flipped, kRight, direction_only));
    EXPECT_TRUE(gradients_agree(kRight, kRight, direction_only));
}

TEST(GradientCheck, WrongLengthFails) {
    std::vector<double> longer = kRight;
    for (double& v : longer) v *= 1.01;
    const GradientTolerance length_only{1, 1e-3, 1e9, 1e9};
    EXPECT_FALSE(gradients_agree(longer, kRight, length_only));
    for (double& v : longer) v = -v;
    EXPECT_FALSE(gradients_agree(longer, kRight, {2, 1e9, 1e-3, 1e-5}));
}

TEST(GradientCheck, WrongElementFails) {
    std::vector<double> wrong = kRight;
    wrong[5] *= 1.1;  // 1e-4 of the whole: only the element's own tolerance sees it
    EXPECT_FALSE(gradients_agree(wrong, kRight, {1e-6, 1e-3, 1e-3, 1e-6}));
    const auto result = gradients_agree(wrong, kRight, {1e-6, 1e-3, 1e-3, 1e-6});
    EXPECT_NE(std::string(result.message()).find("element 5"), std::string::npos) << result.message();
    wrong = kRight;
    wrong[4] = 0.01;  // expected is zero
    EXPECT_FALSE(gradients_agree(wrong, kRight, {1, 1, 1e-3, 1e-3}));
}

TEST(GradientCheck, NotFiniteOrOtherSizeFails) {
    for (double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
        std::vector<double> wrong = kRight;
        wrong[2] = bad;
        EXPECT_FALSE(gradients_agree(wrong, kRight));
        EXPECT_FALSE(gradients_agree(kRight, wrong));
        EXPECT_FALSE(gradients_agree(wrong, wrong));
    }
    EXPECT_FALSE(gradients_agree(std::vector<double>{1, 2}, std::vector<double>{1, 2, 3}));
}

TEST(GradientCheck, SplatArraysAreJudgedEach) {
    Gaussians right;
    right.resize(2);
    for (auto* array :
         {&right.means, &right.quaternions, &right.log_scales, &right.opacity_logits, &right.sh})
        for (size_t i = 0; i < array->size(); ++i) (*array)[i] = float(i + 1);
    EXPECT_TRUE(splat_gradients_agree(right, right));
    const auto broken = [&](auto change) {
        Gaussians wrong = right;
        change(wrong);
        return splat_gradients_agree(wrong, right);
    };
    // The means are far larger than all else, yet a wrong element elsewhere is seen.
    for (float& v : right.means) v *= 1e8f;
    EXPECT_FALSE(broken([](Gaussians& g) { g.means[1] = 0; }));
    EXPECT_FALSE(broken([](Gaussians& g) { g.quaternions[7] *= 1.1f; }));
    EXPECT_FALSE(broken([](Gaussians& g) { g.log_scales[0] = -1; }));
    EXPECT_FALSE(broken([](Gaussians& g) { g.opacity_logits[1] *= 0.9f; }));
    EXPECT_FALSE(broken([](Gaussians& g) { g.sh[5] = 0; }));
    EXPECT_FALSE(broken([](Gaussians& g) { g.sh.pop_back(); }));
}

TEST(GradientCheck, CentralDifferenceFindsTheSlopeAndNoOther) {
    double x = 0.7;
    const auto f = [&] { return std::sin(3 * x); };
    const double slope = 3 * std::cos(2.1);
    EXPECT_NEAR(best_central_difference(f, x, slope), slope, 1e-8);
    EXPECT_EQ(x, 0.7);
    // A wrong claim is not met halfway.
    EXPECT_NEAR(best_central_difference(f, x, slope + 0.1), slope, 1e-4);
}

}  // namespace
}  // namespace ewa::test
