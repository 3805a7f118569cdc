// SPDX-License-Identifier: Apache-2.0
#include "support/gradient_check.h"

#include <algorithm>
#include <cmath>

namespace ewa::test {

namespace {

double largest(std::span<const double> values) {
    double largest = 0;
    for (double v : values) largest = std::max(largest, std::abs(v));
    return largest;
}

/// Scaled by its largest element, so that squares neither overflow nor vanish.
double norm(std::span<const double> values) {
    const double scale = largest(values);
    if (scale == 0) return 0;
    double sum = 0;
    for (double v : values) sum += (v / scale) * (v / scale);
    return scale * std::sqrt(sum);
}

testing::AssertionResult elements_agree(std::span<const double> actual, std::span<const double> expected,
                                        const GradientTolerance& tolerance) {
    const double floor = tolerance.element_absolute * largest(expected);
    size_t worst = 0;
    double worst_ratio = 0;
    for (size_t i = 0; i < actual.size(); ++i) {
        const double allowed = tolerance.element_relative * std::abs(expected[i]) + floor;
        const double ratio = std::abs(actual[i] - expected[i]) / allowed;
        if (ratio > worst_ratio) {
            worst_ratio = ratio;
            worst = i;
        }
    }
    if (worst_ratio <= 1) return testing::AssertionSuccess();
    return testing::AssertionFailure()
           << "element " << worst << " of " << actual.size() << " is " << actual[worst] << ", expected "
           << expected[worst] << ", off by " << worst_ratio << " times the tolerance";
}

}  // namespace

testing::AssertionResult gradients_agree(std::span<const double> actual, std::span<const double> expected,
                                         const GradientTolerance& tolerance) {
    if (actual.size() != expected.size())
        return testing::AssertionFailure() << actual.size() << " elements, expected " << expected.size();
    for (size_t i = 0; i < actual.size(); ++i)
        if (!std::isfinite(actual[i]) || !std::isfinite(expected[i]))
            return testing::AssertionFailure() << "element " << i << " is " << actual[i] << ", expected "
                                               << expected[i] << ": not finite";
    const double actual_norm = norm(actual), expected_norm = norm(expected);
    if (actual_norm == 0 && expected_norm == 0) return testing::AssertionSuccess();
    if (actual_norm == 0)
        return testing::AssertionFailure() << "all zero, expected a norm of " << expected_norm;
    if (expected_norm == 0)
        return testing::AssertionFailure() << "a norm of " << actual_norm << ", expected all zero";

    double cosine = 0;
    std::vector<double> difference(actual.size());
    for (size_t i = 0; i < actual.size(); ++i) {
        cosine += (actual[i] / actual_norm) * (expected[i] / expected_norm);
        difference[i] = actual[i] - expected[i];
    }
    const testing::AssertionResult elements = elements_agree(actual, expected, tolerance);
    if (!(1 - cosine <= tolerance.cosine))
        return testing::AssertionFailure() << "direction: 1 - cosine is " << 1 - cosine << " of at most "
                                           << tolerance.cosine << "; " << elements.message();
    const double error = norm(difference) / expected_norm;
    if (!(error <= tolerance.norm))
        return testing::AssertionFailure() << "relative error of the whole is " << error << " of at most "
                                           << tolerance.norm << "; " << elements.message();
    return elements;
}

double best_central_difference(const std::function<double()>& f, double& value, double claimed,
                               double largest_step, double smallest_step) {
    const double kept = value;
    double best = std::nan("");
    for (double step = largest_step; step > 0.5 * smallest_step; step *= 0.1) {
        const double h = step * std::max(std::abs(kept), 1.0);
        value = kept + h;
        const double high = value, f_high = f();
        value = kept - h;
        const double low = value, f_low = f();
        const double estimate = (f_high - f_low) / (high - low);
        if (std::isnan(best) || std::abs(estimate - claimed) < std::abs(best - claimed)) best = estimate;
    }
    value = kept;
    return best;
}

}  // namespace ewa::test
