// SPDX-License-Identifier: Apache-2.0
// How far a gradient is from the twin's, group by group.
#pragma once
#include <algorithm>
#include <cfloat>
#include <cmath>
#include <vector>

namespace ewa::bench {

/// visit(name, member of a, of b) for each of the five arrays of parameters.
template <class A, class B, class Visit>
void for_each_group(const A& a, const B& b, Visit visit) {
    visit("means", a.means, b.means);
    visit("quaternions", a.quaternions, b.quaternions);
    visit("log scales", a.log_scales, b.log_scales);
    visit("opacity logits", a.opacity_logits, b.opacity_logits);
    visit("SH", a.sh, b.sh);
}

/// |a - b| / max(|b|, least), both within float32's range; without overflow of the squares. Infinite where b
/// is zero and a is not, NaN where a has one.
template <class A>
double relative_distance(const std::vector<A>& a, const std::vector<double>& b, double least = 0) {
    double largest = 0, apart = 0, length = 0;
    const auto limited = [](double v) { return std::clamp(v, -double(FLT_MAX), double(FLT_MAX)); };
    for (const double v : b) largest = std::max(largest, std::abs(limited(v)));
    if (largest == 0) {
        for (const A v : a)
            if (!(v == A(0))) return INFINITY;
        return 0;
    }
    for (size_t i = 0; i < b.size(); ++i) {
        apart += std::pow((limited(double(a[i])) - limited(b[i])) / largest, 2);
        length += std::pow(limited(b[i]) / largest, 2);
        if (std::isnan(double(a[i]))) return NAN;
    }
    return std::sqrt(apart) / std::max(std::sqrt(length), least / largest);
}

}  // namespace ewa::bench
