// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/histogram.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "edit/edited_splats.h"
#include "ewa/error.h"
#include "scene/splat_groups.h"

namespace ewa::viewer {
namespace {

constexpr size_t kMostSamples = 100'000;  // that decide on the borders
constexpr double kTail = 0.001;           // share of the values that may lie beyond a border
constexpr double kFarTail = 0.25;         // of the width of the others: a longer tail lies beyond the border

bool is_left(const std::vector<uint8_t>& states, size_t i) {
    return i >= states.size() || (states[i] & edit::kDeleted) == 0;
}

/// Where a value is on the axis.
double on_axis(const HistogramColumn& column, double value) {
    return column.decades ? std::log(value) : value;
}

/// The finite places on the axis of a part of the splats that are left.
std::vector<double> sampled(const HistogramColumn& column, const std::vector<double>& values,
                            const std::vector<uint8_t>& states) {
    std::vector<double> samples;
    const size_t step = 1 + values.size() / kMostSamples;
    for (size_t i = 0; i < values.size(); i += step)
        if (const double at = on_axis(column, values[i]); is_left(states, i) && std::isfinite(at))
            samples.push_back(at);
    std::ranges::sort(samples);
    return samples;
}

void set_borders(Histogram& histogram, const std::vector<double>& samples) {
    if (samples.empty()) return;
    const size_t tail = size_t(kTail * double(samples.size()));
    const double first = samples[tail], last = samples[samples.size() - 1 - tail];
    const double far = kFarTail * (last - first);
    histogram.low = first - samples.front() > far ? first : samples.front();
    histogram.high = samples.back() - last > far ? last : samples.back();
    if (histogram.column.whole) {
        histogram.low = std::round(histogram.low) - 0.5;
        histogram.high = std::round(histogram.high) + 0.5;
    } else if (!(histogram.low < histogram.high)) {
        const double margin = 0.01 * std::max(1.0, std::abs(histogram.low));
        histogram.low -= margin;
        histogram.high += margin;
    }
}

std::string number_text(double number) {
    return fmt::format("{:.9g}", number);
}

}  // namespace

std::vector<HistogramColumn> histogram_columns(bool cameras) {
    std::vector<HistogramColumn> columns;
    for (const edit::Column& column : edit::columns()) columns.push_back({column.name, column.decades});
    if (cameras) columns.push_back({.name = edit::kViews, .whole = true});
    return columns;
}

std::vector<double> column_values(const std::string& column, const Gaussians& splats,
                                  const edit::Cameras& cameras) {
    if (column == edit::kViews) {
        if (!cameras) throw InputError("this scene has no cameras");
        const std::vector<uint32_t> views = scene::views_of_splats(splats, cameras());
        return {views.begin(), views.end()};
    }
    for (const edit::Column& known : edit::columns()) {
        if (column != known.name) continue;
        std::vector<double> values(splats.size());
        for (size_t i = 0; i < values.size(); ++i) values[i] = known.value(splats, i);
        return values;
    }
    throw InputError("'" + column + "' is no column");
}

double Histogram::border(size_t bin) const {
    const double at = low + (high - low) * double(bin) / double(bins());
    return column.decades ? std::exp(at) : at;
}

Histogram histogram(const HistogramColumn& column, const std::vector<double>& values,
                    const std::vector<uint8_t>& states) {
    Histogram result;
    result.column = column;
    set_borders(result, sampled(column, values, states));
    const double width = result.high - result.low;
    const size_t bins = column.whole ? size_t(std::clamp(width, 1.0, double(kMostBins))) : kMostBins;
    result.left.resize(bins);
    result.selected.resize(bins);
    for (size_t i = 0; i < values.size(); ++i) {
        const double at = on_axis(column, values[i]);
        if (!is_left(states, i) || std::isnan(at)) continue;
        const double place = double(bins) * (at - result.low) / width;
        const size_t bin = size_t(std::clamp(place, 0.0, double(bins - 1)));
        ++result.left[bin];
        if (i < states.size() && (states[i] & edit::kSelected) != 0) ++result.selected[bin];
    }
    return result;
}

std::string range_of_bins(const Histogram& histogram, size_t first, size_t last) {
    const bool from_lowest = first == 0, to_highest = last + 1 >= histogram.bins();
    if (from_lowest && to_highest) return histogram.column.name + "=-inf..inf";
    double low = histogram.border(first), high = histogram.border(last + 1);
    if (histogram.column.whole) {
        low = std::ceil(low);
        high = std::floor(high);
    }
    return histogram.column.name + "=" + (from_lowest ? "" : number_text(low)) + ".." +
           (to_highest ? "" : number_text(high));
}

}  // namespace ewa::viewer
