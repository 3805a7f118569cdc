// SPDX-License-Identifier: Apache-2.0
// Checks of the device's results against the CPU reference, and against the rules of sorts and scans.
#pragma once
#include <algorithm>
#include <cfloat>
#include <cmath>
#include <vector>

#include "bench/device_runs.h"
#include "bench/result.h"

namespace ewa::bench {

/// Counts wrong entries in the depth order, scan, instances, tile order and tile starts of the last run, and
/// compares the projected records with those of the CPU reference. For cases of any size.
std::vector<Check> check_lists(const FrameRun& run, const BenchScene& scene);

/// Whether the CPU reference computes the case in a reasonable time: it blends pixel by pixel in float64.
bool reference_is_feasible(const Case& one);

/// The image of the last run. In float32, a contribution at the 1/255 threshold may be skipped or not.
/// Therefore one bound limits the share of deviating pixels, and another the worst pixel.
std::vector<Check> check_picture(const FrameRun& run, const BenchScene& scene);

/// Loss and gradient of the whole pipeline.
std::vector<Check> check_gradient(std::shared_ptr<gpu::Device> device, const BenchScene& scene);

/// One Adam step from zero moments against the CPU reference, with the gradient that the moments hold.
std::vector<Check> check_update(std::shared_ptr<gpu::Device> device, const BenchScene& scene);

/// visit(name, member of a, of b) for each of the five arrays of parameters.
template <class A, class B, class Visit>
void for_each_group(const A& a, const B& b, Visit visit) {
    visit("means", a.means, b.means);
    visit("quaternions", a.quaternions, b.quaternions);
    visit("log scales", a.log_scales, b.log_scales);
    visit("opacity logits", a.opacity_logits, b.opacity_logits);
    visit("SH", a.sh, b.sh);
}

/// |a - b| / max(|b|, least), with values clamped to the range of float32 and squares that cannot overflow.
/// Infinite if only b is zero, NaN if a has a NaN.
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
