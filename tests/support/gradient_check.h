// SPDX-License-Identifier: Apache-2.0
// Assertions about gradients: is it the right direction, the right length, right in each element, and is
// there one at all. One number cannot tell: a relative error hides a wrong small element, an element
// tolerance a wrong sign near zero.
#pragma once
#include <gtest/gtest.h>

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace ewa::test {

struct GradientTolerance {
    double cosine = 1e-6;            // 1 - cosine of the angle between the two, at most
    double norm = 1e-4;              // |actual - expected| / |expected|, at most
    double element_relative = 1e-3;  // of each element, where it is large enough to matter
    double element_absolute = 1e-5;  // and this share of expected's largest element
};

/// Fails where sizes differ, an element is not finite, one side is all zero and the other is not, the
/// direction, the length or an element is off. Two empty or all-zero sides agree. The message names the worst
/// element.
testing::AssertionResult gradients_agree(std::span<const double> actual, std::span<const double> expected,
                                         const GradientTolerance& tolerance = {});

/// Each of the five arrays of Gaussians, or of a type with the same members, is a gradient of its own.
/// Evaluates to the first that disagrees.
template <class Actual, class Expected>
testing::AssertionResult splat_gradients_agree(const Actual& actual, const Expected& expected,
                                               const GradientTolerance& tolerance = {}) {
    const auto compare = [&](const char* name, const auto& a, const auto& e) -> testing::AssertionResult {
        const std::vector<double> wide_a(a.begin(), a.end()), wide_e(e.begin(), e.end());
        testing::AssertionResult result = gradients_agree(wide_a, wide_e, tolerance);
        return result ? result : testing::AssertionFailure() << name << ": " << result.message();
    };
    testing::AssertionResult result = compare("means", actual.means, expected.means);
    if (result) result = compare("quaternions", actual.quaternions, expected.quaternions);
    if (result) result = compare("log_scales", actual.log_scales, expected.log_scales);
    if (result) result = compare("opacity_logits", actual.opacity_logits, expected.opacity_logits);
    if (result) result = compare("sh", actual.sh, expected.sh);
    return result;
}

/// d f / d value by central differences with steps from `largest` down to `smallest` times max(|value|, 1),
/// by factors of 10; the estimate nearest to `claimed`. Truncation spoils the large steps and rounding the
/// small ones; a claim that none of them comes near is wrong. value is put back.
double best_central_difference(const std::function<double()>& f, double& value, double claimed,
                               double largest = 1e-3, double smallest = 1e-7);

}  // namespace ewa::test
