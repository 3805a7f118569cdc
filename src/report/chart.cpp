// SPDX-License-Identifier: Apache-2.0
#include "report/chart.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

namespace ewa::report {
namespace {

// Units of the drawing; the page scales it.
constexpr double kWidth = 400, kHeight = 240;
constexpr double kLeft = 48, kRight = 16, kTop = 12, kBottom = 44;

/// A tick distance of 1, 2 or 5 times a power of ten that gives about `wanted` ticks.
Axis make_axis(double low, double high, int wanted, bool round_out) {
    if (!(high > low)) {
        const double margin = low == 0 ? 1 : std::abs(low) * 0.05;
        low -= margin;
        high += margin;
    }
    const double raw = (high - low) / wanted;
    const double power = std::pow(10, std::floor(std::log10(raw)));
    const double share = raw / power;
    Axis axis;
    axis.tick = power * (share <= 1.5 ? 1 : share <= 3.5 ? 2 : share <= 7.5 ? 5 : 10);
    axis.low = round_out ? std::floor(low / axis.tick) * axis.tick : low;
    axis.high = round_out ? std::ceil(high / axis.tick) * axis.tick : high;
    return axis;
}

std::string polyline(const Axes& axes, const std::vector<ChartPoint>& points, const char* css) {
    std::string path;
    for (const ChartPoint& p : points)
        path += fmt::format("{}{:.1f},{:.1f}", path.empty() ? "" : " ", axes.px(p.x), axes.py(p.y));
    return fmt::format("<polyline class=\"{}\" points=\"{}\"/>\n", css, path);
}

std::string grid(const Axes& axes, const Chart& chart) {
    std::string svg;
    const double bottom = kHeight - kBottom;
    for (double v : axes.y.ticks())
        svg += fmt::format(
            "<line class=\"grid\" x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\"/>"
            "<text class=\"tick\" text-anchor=\"end\" x=\"{3}\" y=\"{4:.1f}\">{5}</text>\n",
            kLeft, kWidth - kRight, axes.py(v), kLeft - 6, axes.py(v) + 4, short_number(v, 4));
    for (double v : axes.x.ticks())
        svg += fmt::format(
            "<line class=\"axis\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\"/>"
            "<text class=\"tick\" text-anchor=\"middle\" x=\"{0:.1f}\" y=\"{3}\">{4}</text>\n",
            axes.px(v), bottom, bottom + 4, bottom + 17, short_number(v, 4));
    svg += fmt::format("<line class=\"axis\" x1=\"{0}\" x2=\"{1}\" y1=\"{2}\" y2=\"{2}\"/>\n", kLeft,
                       kWidth - kRight, bottom);
    svg += fmt::format("<text class=\"label\" text-anchor=\"middle\" x=\"{}\" y=\"{}\">{}</text>\n",
                       (kLeft + kWidth - kRight) / 2, kHeight - 6, escape_html(chart.x_label));
    return svg;
}

/// The mean over a centred window of a tenth of the points: losses differ much between views.
std::vector<ChartPoint> running_mean(const std::vector<ChartPoint>& points) {
    const size_t half = points.size() / 20;
    std::vector<ChartPoint> mean(points);
    for (size_t i = 0; i < points.size(); ++i) {
        const size_t reach = std::min({half, i, points.size() - 1 - i});
        double sum = 0;
        for (size_t j = i - reach; j <= i + reach; ++j) sum += points[j].y;
        mean[i].y = sum / double(2 * reach + 1);
    }
    return mean;
}

}  // namespace

double Axis::place(double value) const {
    return logarithmic ? std::log10(value) : value;
}

std::vector<double> Axis::ticks() const {
    std::vector<double> at;
    for (double i = std::ceil(low / tick - 1e-9); i * tick <= high + 1e-9 * tick; ++i)
        at.push_back(logarithmic ? std::pow(10, i * tick) : i * tick);
    return at;
}

std::string escape_html(std::string_view text) {
    std::string out;
    out.reserve(text.size());
    for (const char c : text) {
        switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '"':
                out += "&quot;";
                break;
            case '\'':
                out += "&#39;";
                break;
            default:
                if (static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\t') out += c;
        }
    }
    return out;
}

std::string short_number(double value, int digits) {
    if (!std::isfinite(value)) return std::isnan(value) ? "n/a" : value > 0 ? "∞" : "-∞";
    static constexpr const char* kSuffix[] = {"", "k", "M", "G", "T"};
    int thousands = 0;
    while (std::abs(value) >= 1000 && thousands < 4) {
        value /= 1000;
        ++thousands;
    }
    return fmt::format("{:.{}g}{}", value == 0 ? 0.0 : value, digits, kSuffix[thousands]);
}

std::string chart_svg(const Chart& chart) {
    std::vector<ChartPoint> points;
    for (const ChartPoint& p : chart.points)
        if (std::isfinite(p.x) && std::isfinite(p.y)) points.push_back(p);
    if (points.size() < 2) return "";

    const auto [low, high] =
        std::minmax_element(points.begin(), points.end(), [](auto& a, auto& b) { return a.y < b.y; });
    Axes axes{{}, {}, kWidth, kHeight, kLeft, kRight, kTop, kBottom};
    axes.x = make_axis(std::min(0.0, points.front().x), points.back().x, 4, false);
    axes.y = make_axis(chart.zero_based ? std::min(0.0, low->y) : low->y, high->y, 4, true);

    std::string svg = fmt::format(
        "<figure class=\"chart\"><figcaption>{}{}</figcaption>\n"
        "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">\n",
        escape_html(chart.title),
        chart.y_label.empty() ? "" : " <span>" + escape_html(chart.y_label) + "</span>", kWidth, kHeight,
        escape_html(chart.title));
    svg += grid(axes, chart);
    svg += polyline(axes, points, chart.smooth ? "raw" : "line");
    if (chart.smooth) svg += polyline(axes, running_mean(points), "line");
    if (points.size() <= 30 && !chart.smooth)
        for (const ChartPoint& p : points)
            svg += fmt::format("<circle class=\"dot\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\"/>", axes.px(p.x),
                               axes.py(p.y));
    return svg + "</svg></figure>\n";
}

}  // namespace ewa::report
