// SPDX-License-Identifier: Apache-2.0
#include "report/work_precision.h"

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

#include "report/chart.h"

namespace ewa::report {
namespace {

constexpr double kWidth = 720, kHeight = 420, kLeft = 64, kRight = 190, kTop = 36, kBottom = 52;
// Told apart by those who do not tell red from green (Okabe and Ito 2008).
constexpr const char* kColors[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                   "#e69f00", "#56b4e9", "#8c6d31"};

bool shown(const WorkPoint& p) {
    return std::isfinite(p.time) && std::isfinite(p.error) && p.time > 0 && p.error > 0;
}

/// Whole powers of ten around the values, or whole steps of decibels; at least one.
class Axis {
  public:
    explicit Axis(bool even = false) : even_(even) {}
    void take(double value) {
        const int below = int(std::floor(place(value))), above = int(std::ceil(place(value)));
        low_ = empty_ ? below : std::min(low_, below);
        high_ = empty_ ? above : std::max(high_, above);
        if (high_ == low_) ++high_;
        empty_ = false;
    }
    double share(double value) const { return (place(value) - low_) / (high_ - low_); }
    std::vector<double> ticks() const {
        std::vector<double> at;
        for (int i = low_; i <= high_; ++i) at.push_back(even_ ? kStep * i : std::pow(10, i));
        return at;
    }

  private:
    static constexpr double kStep = 2;  // dB
    double place(double value) const { return even_ ? value / kStep : std::log10(value); }
    bool even_, empty_ = true;
    int low_ = 0, high_ = 1;
};

struct Plot {
    Axis x, y;
    double px(double v) const { return kLeft + x.share(v) * (kWidth - kLeft - kRight); }
    double py(double v) const { return kHeight - kBottom - y.share(v) * (kHeight - kTop - kBottom); }
};

std::string grid(const Plot& plot, const WorkPrecision& diagram) {
    std::string svg = fmt::format("<text x=\"{}\" y=\"20\" font-weight=\"600\" font-size=\"15\">{}</text>\n",
                                  kLeft, escape_html(diagram.title));
    const auto line = [](double x1, double y1, double x2, double y2) {
        return fmt::format(
            "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#8a8f94\" "
            "stroke-opacity=\"0.4\"/>",
            x1, y1, x2, y2);
    };
    for (const double tick : plot.x.ticks()) {
        const double x = plot.px(tick);
        svg += line(x, kTop, x, kHeight - kBottom) +
               fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{:g}</text>\n", x,
                           kHeight - kBottom + 18, tick);
    }
    for (const double tick : plot.y.ticks()) {
        const double y = plot.py(tick);
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

std::string drawn(const Plot& plot, const WorkSeries& series, size_t number) {
    const char* color = kColors[number % std::size(kColors)];
    std::string path, dots;
    for (const WorkPoint& p : series.points) {
        if (!shown(p)) continue;
        const double x = plot.px(p.time), y = plot.py(p.error);
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
    Plot plot{Axis(false), Axis(diagram.decibels)};
    size_t points = 0;
    for (const WorkSeries& series : diagram.series)
        for (const WorkPoint& p : series.points) {
            if (!shown(p)) continue;
            plot.x.take(p.time);
            plot.y.take(p.error);
            ++points;
        }
    if (points < 2) return "";
    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
        "role=\"img\" "
        "aria-label=\"{2}\" font-family=\"system-ui, DejaVu Sans, sans-serif\" font-size=\"12\" "
        "fill=\"#70777d\">\n",
        kWidth, kHeight, escape_html(diagram.title));
    svg += grid(plot, diagram);
    for (size_t i = 0; i < diagram.series.size(); ++i) svg += drawn(plot, diagram.series[i], i);
    return svg + "</svg>\n";
}

std::string work_precision_html(const WorkPrecision& diagram) {
    const std::string svg = work_precision_svg(diagram);
    if (svg.empty()) return "";
    std::string html = "<h2>Error against run time</h2>\n" + svg;
    for (const std::string& note : diagram.notes) html += "<p class=\"soft\">" + escape_html(note) + "</p>\n";
    html += fmt::format(
        "<table><tr><th>way</th><th></th><th class=\"number\">{}</th><th class=\"number\">{}</th>"
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
