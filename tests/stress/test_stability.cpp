// SPDX-License-Identifier: Apache-2.0
// Every stiff and extreme scene of `ewa bench --stability`, under the validation layer: on the device against the CPU
// reference, and as the start of a training.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <string>

#include "bench/stability/stability.h"
#include "gpu/test_device.h"
#include "support/splat_scenes.h"

namespace ewa::test {
namespace {

const std::vector<bench::StabilityCase>& cases() {
    static const std::vector<bench::StabilityCase> all = bench::stability_cases();
    return all;
}

class Stability : public testing::TestWithParam<size_t> {};

TEST_P(Stability, PictureAndGradientAreWithinTheirBounds) {
    const bench::StabilityResult result = bench::compare_with_reference(device(), cases()[GetParam()]);
    EXPECT_TRUE(result.finite);
    EXPECT_EQ(result.skipped, result.skipped_by_reference);
    EXPECT_GT(result.drawn, 0u);
    EXPECT_LE(result.pixels_at_threshold, std::max<uint64_t>(4, result.pixels / 200));
    for (const bench::Comparison& c : result.comparisons)
        EXPECT_TRUE(c.good()) << c.of << ": " << c.error << ", at most " << c.bound << " (condition "
                              << c.condition << ")";
}

/// Every second case is slow.
class StabilityTraining : public testing::TestWithParam<size_t> {};

TEST_P(StabilityTraining, StaysFinite) {
    const bench::StabilityCase& one = cases()[GetParam()];
    if (!bench::trains(one)) return;
    const bench::StabilityTraining training =
        bench::train_from(device(), one, one.gaussians.size() > 10000 ? 5 : 40);
    EXPECT_TRUE(training.finite);
}

std::string case_name(const testing::TestParamInfo<size_t>& tested) {
    std::string name = cases()[tested.param].name;
    for (char& c : name) {
        if (c == '-') c = 'm';
        if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
    }
    return name;
}

INSTANTIATE_TEST_SUITE_P(All, Stability, testing::Range(size_t(0), cases().size()), case_name);
INSTANTIATE_TEST_SUITE_P(All, StabilityTraining, testing::Range(size_t(0), cases().size(), size_t(2)),
                         case_name);
INSTANTIATE_TEST_SUITE_P(Slow, StabilityTraining, testing::Range(size_t(1), cases().size(), size_t(2)),
                         case_name);

bench::StabilityCase named(const std::string& name) {
    for (const bench::StabilityCase& one : cases())
        if (one.name == name) return one;
    ADD_FAILURE() << "no case " << name;
    return {};
}

TEST(StabilityOrdinary, IsWithinTheTightBounds) {
    for (const char* name : {"ordinary", "ordinary_antialias", "ordinary_density"}) {
        const bench::StabilityResult result = bench::compare_with_reference(device(), named(name));
        for (const bench::Comparison& c : result.comparisons)
            EXPECT_LE(c.error, c.of == "picture" || c.of == "loss" ? 5e-6 : 1e-4) << name << ' ' << c.of;
    }
}

TEST(StabilityNeedles, KeepTheirDigitsWhereAPlainDeterminantLosesThem) {
    for (const char* name : {"long_axes_1:1e+04", "long_axes_1:1e+07"}) {
        const bench::StabilityResult result = bench::compare_with_reference(device(), named(name));
        for (const bench::Comparison& c : result.comparisons) EXPECT_LE(c.error, 1e-3) << name << ' ' << c.of;
        EXPECT_GT(result.plain_determinant, 20 * result.comparisons.front().error) << name;
    }
}

/// In such a cloud, decisions at 1/255 differ from the reference's, and many pixels are close to one.
TEST(SlowStability, OfFaintCloudsIsWithinItsBounds) {
    for (const auto& [count, scale] : {std::pair{6000u, -2.5f}, {20000u, -3.5f}}) {
        SCOPED_TRACE(count);
        Gaussians cloud = test::storable_splats(3, count, 0);
        for (size_t i = 0; i < cloud.size(); ++i) {
            cloud.opacity_logits[i] = std::log(0.02f / 0.98f);
            for (size_t k = 0; k < 3; ++k) cloud.log_scales[3 * i + k] = scale;
        }
        const bench::StabilityResult result =
            bench::compare_with_reference(device(), bench::stability_case_of("cloud", cloud));
        EXPECT_TRUE(result.good()) << result.verdict();
    }
}

/// The suite itself must be able to fail: what other splats look like is not within the bounds, nor is their
/// gradient.
TEST(StabilityComparison, FindsAWrongScene) {
    bench::StabilityCase one = named("ordinary");
    bench::StabilityResult result = bench::compare_with_reference(device(), one);
    ASSERT_TRUE(result.good());
    const auto comparisons_broken_by = [&](const std::function<void(Gaussians&)>& change) {
        Gaussians other = one.gaussians;
        change(other);
        std::string broken;
        for (const bench::Comparison& c : bench::compare_with_reference(device(), one, &other).comparisons)
            if (!c.good()) broken += c.of + ",";
        return broken;
    };
    EXPECT_EQ(comparisons_broken_by([](Gaussians&) {}), "");
    const std::string all =
        "picture,loss,means,quaternions,log scales,opacity logits,SH,camera rotation,camera shift,focal "
        "length,";
    EXPECT_EQ(comparisons_broken_by([](Gaussians& g) { g.means[0] += 0.05f; }), all);
    EXPECT_EQ(comparisons_broken_by([](Gaussians& g) {
                  for (float& logit : g.opacity_logits) logit += 0.01f;
              }),
              all);
    EXPECT_NE(comparisons_broken_by([](Gaussians& g) { g.log_scales[3] += 1e-3f; }).find("picture"),
              std::string::npos);
    result.pixels_at_threshold = result.pixels / 100;
    EXPECT_FALSE(result.good());
    result.pixels_at_threshold = 0;
    EXPECT_TRUE(result.good());
    result.comparisons.front().error = NAN;
    EXPECT_FALSE(result.good());
    result.comparisons.front().error = 0;
    result.skipped = 1;
    EXPECT_FALSE(result.good());
}

}  // namespace
}  // namespace ewa::test
