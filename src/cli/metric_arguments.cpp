// SPDX-License-Identifier: Apache-2.0
#include "cli/metric_arguments.h"

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

#include "core/text.h"

namespace ewa::cli {
namespace {

constexpr size_t kLineWidth = 100, kLongestName = 40;

int decimals_of(const std::string& metric) {
    const auto& all = all_metrics();
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const Metric& known) { return known.name == metric; });
    return found == all.end() ? 4 : found->decimals;
}

std::string value_text(const Figure& figure) {
    return std::isnan(figure.value) ? "-" : fmt::format("{:.{}f}", figure.value, decimals_of(figure.name));
}

size_t column_width(const Figure& figure) {
    return std::max<size_t>(9, figure.name.size() + 2);
}

/// Columns first .. end of all rows, below their names.
std::string table_part(const std::vector<FigureRow>& rows, size_t name_width, size_t first, size_t end) {
    std::string text = fmt::format("{:{}}", "", name_width);
    for (size_t k = first; k < end; ++k)
        text += fmt::format("{:>{}}", rows.front().figures[k].name, column_width(rows.front().figures[k]));
    text += '\n';
    for (const FigureRow& row : rows) {
        text += fmt::format("{:{}}", core::one_line(row.name), name_width);
        for (size_t k = first; k < end; ++k)
            text += fmt::format("{:>{}}", value_text(row.figures[k]), column_width(row.figures[k]));
        text += '\n';
    }
    return text;
}

}  // namespace

Measures MetricArguments::measures() const {
    Measures result;
    std::string list = metrics;
    if (protocol == "nerfbaselines") result.protocol = Protocol::nerfbaselines;
    if (protocol == "inria") result.protocol = Protocol::inria;
    if (fitted && protocol == "ewa") list.append(list.empty() ? "" : ",").append(kFittedMetric);
    if (!list.empty()) result.meter = Meter(metrics_named(list));
    return result;
}

std::string figure_table(const std::vector<FigureRow>& rows) {
    if (rows.empty() || rows.front().figures.empty()) return "";
    size_t name_width = 0;
    for (const FigureRow& row : rows) name_width = std::max(name_width, core::one_line(row.name).size());
    name_width = std::min(name_width, kLongestName);
    std::string text;
    const std::vector<Figure>& columns = rows.front().figures;
    for (size_t first = 0, end = 0; first < columns.size(); first = end) {
        size_t width = name_width;
        while (end < columns.size() && (end == first || width + column_width(columns[end]) <= kLineWidth))
            width += column_width(columns[end++]);
        text += table_part(rows, name_width, first, end);
    }
    return text;
}

std::string figures_text(const std::vector<Figure>& figures) {
    std::string text;
    for (const Figure& figure : figures)
        text += (text.empty() ? "" : ", ") + figure.name + " " +
                (std::isnan(figure.value) ? "not computed" : value_text(figure));
    return text;
}

void add_figures(report::Json& json, const std::vector<Figure>& figures) {
    for (const Figure& figure : figures)
        json[figure.name] = std::isfinite(figure.value) ? report::Json(figure.value) : report::Json();
}

}  // namespace ewa::cli
