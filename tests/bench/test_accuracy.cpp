// SPDX-License-Identifier: Apache-2.0
// Error against run time: what a point is worth, and the whole measurement of a small scene.
#include "bench/accuracy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <map>

#include "bench/stability/stability.h"
#include "ewa/splat_edit.h"
#include "reference/volume.h"

namespace ewa::bench {
namespace {

TEST(Accuracy, APointIsOnTheFrontIfNothingIsFasterAndLessWrong) {
    std::vector<report::WorkSeries> series{
        {"ray, opacity", true, {{"a", 1, 0.1}, {"b", 4, 0.01}}},
        {"march, opacity", true, {{"few", 2, 0.2}, {"many", 8, 0.001}, {"slow", 9, 0.005}}},
        {"march, density", true, {{"few", 3, 0.3}}},
    };
    set_verdicts(series);
    EXPECT_EQ(series[0].points[0].verdict, "on the front");
    EXPECT_EQ(series[0].points[1].verdict, "on the front");
    EXPECT_EQ(series[1].points[0].verdict, "ray, opacity: a is faster and less wrong");
    EXPECT_EQ(series[1].points[1].verdict, "on the front");
    // The best of those that are faster and less wrong.
    EXPECT_EQ(series[1].points[2].verdict, "march, opacity: many is faster and less wrong");
    // Points of another exact image are no rivals.
    EXPECT_EQ(series[2].points[0].verdict, "on the front");
}

/// The RMS error of splatting in float64, at every third pixel.
double splatting_error(const Gaussians& gaussians, const Camera& camera) {
    RenderOptions options;
    options.kernel = gaussians.density ? Footprint::density : Footprint::peak;
    const reference::Volume right(gaussians, camera, options),
        splatted(gaussians, camera, options, {true, true, true, true, true, true});
    double sum = 0, count = 0;
    for (int i = 0; i < camera.width * camera.height; i += 3) {
        const double x = i % camera.width + 0.5, y = i / camera.width + 0.5;
        const glm::dvec3 e = right.exact(x, y) - splatted.exact(x, y);
        sum += glm::dot(e, e);
        count += 3;
    }
    return std::sqrt(sum / count);
}

TEST(Accuracy, OpacitiesAreFittedToEachExactImage) {
    // A large splat in front of the camera, whose density has another logit than its opacity.
    Gaussians densities;
    densities.resize(1);
    densities.means = {0, 0, 3};
    densities.quaternions = {1, 0, 0, 0};
    densities.log_scales = {-0.5f, -0.5f, -0.5f};
    densities.opacity_logits = {3};
    densities.sh = {1, 1, 1};
    densities.density = true;
    Gaussians opacities = densities;
    fit_opacities(opacities, false);
    ASSERT_NE(opacities.opacity_logits, densities.opacity_logits);
    const Camera camera{16, 16, 16, 16, 8, 8, glm::dmat3(1), glm::dvec3(0)};
    const auto device = open_device({});
    const Accuracy accuracy = measure_accuracy(device, densities, camera, {});
    ASSERT_EQ(accuracy.references.size(), 2u);
    EXPECT_NEAR(accuracy.references[0].splatting, splatting_error(opacities, camera), 1e-6);
    EXPECT_NEAR(accuracy.references[1].splatting, splatting_error(densities, camera), 1e-6);
    // One splat has no order. It has a formula only where alpha is not that of a density.
    for (const AccuracyReference& one : accuracy.references) {
        std::map<std::string, const Cause*> causes;
        for (const Cause& cause : one.causes) causes[cause.name.substr(0, cause.name.find(':'))] = &cause;
        EXPECT_EQ(causes.contains("formula"), one.name == "opacity");
        ASSERT_TRUE(causes.contains("order") && causes.contains("low-pass"));
        EXPECT_LT(causes["order"]->alone, 1e-6) << one.name;
        EXPECT_NEAR(causes["order"]->without, one.splatting, 1e-9) << one.name;
        EXPECT_GT(causes["low-pass"]->alone, 1e-4) << one.name;
        EXPECT_NE(causes["low-pass"]->without, one.splatting) << one.name;
    }
    for (const report::WorkSeries& series : accuracy.series) {
        if (series.name.starts_with("splatting, ")) {
            EXPECT_GT(series.points.front().error, series.points.back().error) << "by the cut-off";
        }
        if (!series.name.starts_with("march, ")) continue;
        EXPECT_LT(series.points.back().error, 1e-4) << series.name;
    }
}

TEST(StabilityVerdict, NamesAllThatIsWrong) {
    StabilityResult result;
    result.pixels = 100;
    result.comparisons = {{"picture", 1e-7, 5e-6, 1}, {"means", 1e-4, 1e-4, 1}};
    EXPECT_EQ(result.verdict(), "ok");
    result.skipped = 1;
    EXPECT_EQ(result.verdict(), "SKIPPED, the reference 0");
    result.skipped = 0;
    result.pixels_at_threshold = 5;
    result.comparisons[1].error = std::nan("");
    EXPECT_EQ(result.verdict(), "5 PIXELS AT A THRESHOLD, WRONG means");
    result.pixels = 1000;
    result.finite = false;
    result.skipped = 3;
    result.skipped_by_reference = 2;
    result.comparisons[0].error = 6e-6;
    EXPECT_EQ(result.verdict(), "NOT FINITE, SKIPPED, the reference 2, WRONG picture, WRONG means");
}

TEST(Accuracy, AFileOfDensitiesIsJudgedWithItsKernel) {
    Gaussians gaussians;
    gaussians.resize(1);
    EXPECT_EQ(stability_case_of("a", gaussians).options.kernel, Footprint::peak);
    gaussians.density = true;
    EXPECT_EQ(stability_case_of("a", gaussians).options.kernel, Footprint::density);
}

}  // namespace
}  // namespace ewa::bench
