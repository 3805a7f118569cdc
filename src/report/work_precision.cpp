// SPDX-License-Identifier: Apache-2.0
#include "report/work_precision.h"

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "report/chart.h"

namespace ewa::report {
namespace {

constexpr double kWidth = 720, kHeight = 420, kLeft = 64, kRight = 190, kTop = 36, kBottom = 52;
// Distinct for readers who cannot tell red from green (Okabe and Ito 2008).
constexpr const char* kColors[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                   "#e69f00", "#56b4e9", "#8c6d31"};
constexpr double kDecibelStep = 2;

bool shown(const WorkPoint& p) {
    return std::isfinite(p.time) && std::isfinite(p.error) && p.time > 0 && p.error > 0;
}

/// An axis from whole step to whole step around the values, at least one step long.
Axis whole_steps(const std::vector<double>& values, Axis axis) {
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    axis.low = axis.tick * std::floor(axis.place(*least) / axis.tick);
    axis.high = axis.tick * std::ceil(axis.place(*most) / axis.tick);
    if (axis.high == axis.low) axis.high += axis.tick;
    return axis;
}

std::string grid(const Axes& axes, const WorkPrecision& diagram) {
    std::string svg = fmt::format("<text x=\"{}\" y=\"20\" font-weight=\"600\" font-size=\"15\">{}</text>\n",
                                  kLeft, escape_html(diagram.title));
    const auto line = [](double x1, double y1, double x2, double y2) {
        return fmt::format(
            "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#8a8f94\" "
            "stroke-opacity=\"0.4\"/>",
            x1, y1, x2, y2);
    };
    for (const double tick : axes.x.ticks()) {
        const double x = axes.px(tick);
        svg += line(x, kTop, x, kHeight - kBottom) +
               fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{:g}</text>\n", x,
                           kHeight - kBottom + 18, tick);
    }
    for (const double tick : axes.y.ticks()) {
        const double y = axes.py(tick);
        svg += line(kLeft, y, kWidth - kRight, y) +
               fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{:g}</text>\n", kLeft - 6, y + 4,
                           tick);
    }
    svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n",
                       (kLeft + kWidth - kRight) / 2, kHeight - 10, escape_html(diagram.x_label));
    svg += fmt::format("<text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                       (kTop + kHeight - kBottom) / 2, escape_html(diagram.y_label));
    return svg;
}

std::string drawn(const Axes& axes, const WorkSeries& series, size_t number) {
    const char* color = kColors[number % std::size(kColors)];
    std::string path, dots;
    for (const WorkPoint& p : series.points) {
        if (!shown(p)) continue;
        const double x = axes.px(p.time), y = axes.py(p.error);
        path += fmt::format("{:.1f},{:.1f} ", x, y);
        dots += fmt::format(
            "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\"><title>{}: {:.3g}, {:.3g}</title>"
            "</circle>\n",
            x, y, color, escape_html(series.name + ", " + p.name), p.time, p.error);
    }
    std::string svg;
    if (series.line)
        svg += fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>\n", path,
                           color);
    const double y = kTop + 14 + 22 * double(number);
    svg += dots +
           fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"4\" fill=\"{}\"/><text x=\"{}\" y=\"{}\">{}</text>\n",
                       kWidth - kRight + 18, y - 4, color, kWidth - kRight + 28, y, escape_html(series.name));
    return svg;
}

}  // namespace

std::string work_precision_svg(const WorkPrecision& diagram) {
    std::vector<double> times, errors;
    for (const WorkSeries& series : diagram.series)
        for (const WorkPoint& p : series.points) {
            if (!shown(p)) continue;
            times.push_back(p.time);
            errors.push_back(p.error);
        }
    if (times.size() < 2) return "";
    const Axis powers{true, 0, 1, 1}, decibels{false, 0, 1, kDecibelStep};
    const Axes axes{whole_steps(times, powers),
                    whole_steps(errors, diagram.decibels ? decibels : powers),
                    kWidth,
                    kHeight,
                    kLeft,
                    kRight,
                    kTop,
                    kBottom};
    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
        "role=\"img\" aria-label=\"{2}\" font-family=\"system-ui, DejaVu Sans, sans-serif\" font-size=\"12\" "
        "fill=\"#70777d\">\n",
        kWidth, kHeight, escape_html(diagram.title));
    svg += grid(axes, diagram);
    for (size_t i = 0; i < diagram.series.size(); ++i) svg += drawn(axes, diagram.series[i], i);
    return svg + "</svg>\n";
}

std::string work_precision_html(const WorkPrecision& diagram) {
    const std::string svg = work_precision_svg(diagram);
    if (svg.empty()) return "";
    std::string html = "<h2>Error against run time</h2>\n" + svg;
    for (const std::string& note : diagram.notes) html += "<p class=\"soft\">" + escape_html(note) + "</p>\n";
    html += fmt::format(
        "<table><tr><th>method</th><th></th><th class=\"number\">{}</th><th class=\"number\">{}</th>"
        "<th class=\"number\">worst</th></tr>\n",
        escape_html(diagram.x_label), escape_html(diagram.y_label));
    for (const WorkSeries& series : diagram.series)
        for (const WorkPoint& p : series.points)
            html += fmt::format(
                "<tr><td>{}</td><td>{}</td><td class=\"number\">{:.3g}</td><td class=\"number\">{:.2e}</td>"
                "<td class=\"number\">{:.2e}</td></tr>\n",
                escape_html(series.name), escape_html(p.name), p.time, p.error, p.worst);
    return html + "</table>\n";
}

nlohmann::ordered_json work_precision_json(const WorkPrecision& diagram) {
    nlohmann::ordered_json json{
        {"schema", "ewa-work-precision-1"}, {"title", diagram.title},
        {"time", diagram.x_label},          {"error", diagram.y_label},
        {"notes", diagram.notes},           {"series", nlohmann::ordered_json::array()}};
    for (const WorkSeries& series : diagram.series) {
        nlohmann::ordered_json points = nlohmann::ordered_json::array();
        for (const WorkPoint& p : series.points)
            points.push_back({{"name", p.name}, {"time", p.time}, {"error", p.error}, {"worst", p.worst}});
        json["series"].push_back({{"name", series.name}, {"points", points}});
    }
    return json;
}

}  // namespace ewa::report
