// SPDX-License-Identifier: Apache-2.0
#include "cli/splat_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/typing.h"
#include "ewa/error.h"
#include "shared/constants.h"

namespace ewa::cli {
namespace {

/// shown: an increasing function that maps a value to the one that is reported.
template <typename Shown>
Spread make_spread(std::vector<double> values, Shown shown) {
    std::erase_if(values, [](double v) { return !std::isfinite(v); });
    Spread spread;
    if (values.empty()) return spread;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    spread.median = shown(*middle);
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    spread.min = shown(*low);
    spread.max = shown(*high);
    return spread;
}

class Tally {
  public:
    void add(double error) {
        ++count_;
        if (!std::isfinite(error)) error = std::numeric_limits<double>::infinity();
        largest_ = std::max(largest_, error);
        sum_ += error;
    }
    void add(double a, double b) {
        const bool same = a == b || (!std::isfinite(a) && !std::isfinite(b));
        add(same ? 0 : std::abs(a - b));
    }
    Difference named(const char* what, const char* unit) const {
        return {what, unit, largest_, count_ == 0 ? 0 : sum_ / double(count_)};
    }

  private:
    double largest_ = 0, sum_ = 0;
    size_t count_ = 0;
};

/// The angle of the rotation between p and q. The sine of its half is exact for small angles.
double degrees_between(const float* p, const float* q) {
    const double lengths =
        std::sqrt((double(p[0]) * p[0] + double(p[1]) * p[1] + double(p[2]) * p[2] + double(p[3]) * p[3]) *
                  (double(q[0]) * q[0] + double(q[1]) * q[1] + double(q[2]) * q[2] + double(q[3]) * q[3]));
    if (!(lengths > 0) || !std::isfinite(lengths)) return 0;
    const double x = double(p[0]) * q[1] - double(p[1]) * q[0] - double(p[2]) * q[3] + double(p[3]) * q[2];
    const double y = double(p[0]) * q[2] + double(p[1]) * q[3] - double(p[2]) * q[0] - double(p[3]) * q[1];
    const double z = double(p[0]) * q[3] - double(p[1]) * q[2] + double(p[2]) * q[1] - double(p[3]) * q[0];
    const double sine = std::min(std::sqrt(x * x + y * y + z * z) / lengths, 1.0);
    return 2 * std::asin(sine) * 180 / std::numbers::pi;
}

double sigmoid(double x) {
    return 1 / (1 + std::exp(-x));
}

}  // namespace

SplatStatistics splat_statistics(const Gaussians& g) {
    SplatStatistics statistics;
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    statistics.low.fill(kInfinity);
    statistics.high.fill(-kInfinity);
    for (size_t i = 0; i < g.size(); ++i) {
        if (!drawable(g, i)) ++statistics.nonfinite;
        for (size_t axis = 0; axis < 3; ++axis) {
            const double v = g.world_mean(i)[int(axis)];
            if (!std::isfinite(v)) continue;
            statistics.low[axis] = std::min(statistics.low[axis], v);
            statistics.high[axis] = std::max(statistics.high[axis], v);
        }
    }
    for (size_t axis = 0; axis < 3; ++axis)
        if (statistics.low[axis] > statistics.high[axis]) statistics.low[axis] = statistics.high[axis] = 0;

    std::vector<double> opacities;
    for (const float logit : g.opacity_logits) opacities.push_back(sigmoid(logit));
    statistics.opacity = make_spread(std::move(opacities), [](double v) { return v; });
    statistics.scale = make_spread(std::vector<double>(g.log_scales.begin(), g.log_scales.end()),
                                   [](double v) { return std::exp(v); });
    return statistics;
}

std::string skipped_text(uint64_t skipped, const std::string& why) {
    const std::string text = "skipped " + core::counted(skipped, "splat");
    if (why.empty()) return text + " with a value beyond the range of float32";
    return text + " with a value that is not finite: " + why;
}

std::array<Difference, 6> differences(const Gaussians& a, const Gaussians& b) {
    if (a.size() != b.size())
        throw RunError("there are " + std::to_string(a.size()) + " splats on one side and " +
                       std::to_string(b.size()) + " on the other");
    Tally means, scales, rotations, opacities, colors, sh;
    const size_t strides[] = {a.sh_stride(), b.sh_stride()};
    for (size_t i = 0; i < a.size(); ++i) {
        for (size_t k = 0; k < 3; ++k) {
            means.add(a.world_mean(i)[int(k)], b.world_mean(i)[int(k)]);
            scales.add(a.log_scales[3 * i + k], b.log_scales[3 * i + k]);
            colors.add(a.sh[strides[0] * i + k] * shared::SH_C0, b.sh[strides[1] * i + k] * shared::SH_C0);
        }
        rotations.add(degrees_between(&a.quaternions[4 * i], &b.quaternions[4 * i]));
        opacities.add(sigmoid(a.opacity_logits[i]), sigmoid(b.opacity_logits[i]));
        for (size_t k = 3; k < std::max(strides[0], strides[1]); ++k)
            sh.add(k < strides[0] ? a.sh[strides[0] * i + k] : 0,
                   k < strides[1] ? b.sh[strides[1] * i + k] : 0);
    }
    return {means.named("position", "world units"), scales.named("scale", "of the logarithm"),
            rotations.named("rotation", "degrees"), opacities.named("opacity", "of 0..1"),
            colors.named("colour", "of 0..1"),      sh.named("SH above degree 0", "")};
}

}  // namespace ewa::cli
