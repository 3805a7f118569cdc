// SPDX-License-Identifier: Apache-2.0
#include "cli/splat_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace ewa::cli {
namespace {

/// values: before `shown` is applied, which must be increasing; the bins are even in the values themselves.
template <typename Shown>
Spread make_spread(std::vector<double> values, Shown shown) {
    std::erase_if(values, [](double v) { return !std::isfinite(v); });
    Spread spread;
    if (values.empty()) return spread;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    spread.median = shown(*middle);
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    const double base = *low, range = *high - *low;
    spread.min = shown(*low);
    spread.max = shown(*high);
    for (const double v : values) {
        const int bin = range > 0 ? static_cast<int>((v - base) / range * kHistogramBins) : 0;
        ++spread.histogram[static_cast<size_t>(std::min(bin, kHistogramBins - 1))];
    }
    return spread;
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
    for (const float logit : g.opacity_logits) opacities.push_back(1 / (1 + std::exp(-double(logit))));
    statistics.opacity = make_spread(std::move(opacities), [](double v) { return v; });
    statistics.scale = make_spread(std::vector<double>(g.log_scales.begin(), g.log_scales.end()),
                                   [](double v) { return std::exp(v); });
    return statistics;
}

std::string histogram_text(const Spread& spread) {
    static constexpr std::string_view kShades = " .:-=+*#%@";
    const size_t most = *std::max_element(spread.histogram.begin(), spread.histogram.end());
    std::string text;
    for (const size_t count : spread.histogram) {
        const size_t shade = most == 0 || count == 0 ? 0 : 1 + (count * (kShades.size() - 2)) / most;
        text += kShades[shade];
    }
    return text;
}

}  // namespace ewa::cli
