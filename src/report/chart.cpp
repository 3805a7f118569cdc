// SPDX-License-Identifier: Apache-2.0
#include "report/chart.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

namespace ewa::report {
namespace {

/// One axis of a diagram: linear, or in powers of ten.
struct Axis {
    bool logarithmic = false;
    double low = 0, high = 1, tick = 1;  // of a logarithmic axis: exponents

    double place(double value) const { return logarithmic ? std::log10(value) : value; }
    /// The position of a value: 0 at the start of the axis, 1 at its end.
    double share(double value) const { return (place(value) - low) / (high - low); }
    std::vector<double> ticks() const {
        std::vector<double> at;
        for (double i = std::ceil(low / tick - 1e-9); i * tick <= high + 1e-9 * tick; ++i)
            at.push_back(logarithmic ? std::pow(10, i * tick) : i * tick);
        return at;
    }
};

/// The area of a chart and its margins, in units that the page scales.
struct ChartArea {
    double width, height, left, right, top, bottom;
};
constexpr ChartArea kChart{400, 240, 48, 16, 12, 44}, kWork{740, 420, 64, 210, 36, 52};

/// The axes of a diagram.
struct Axes {
    ChartArea area;
    Axis x, y;

    double px(double v) const { return area.left + x.share(v) * (area.width - area.left - area.right); }
    double py(double v) const {
        return area.height - area.bottom - y.share(v) * (area.height - area.top - area.bottom);
    }
};

/// A tick distance of 1, 2 or 5 times a power of ten that gives about 4 ticks.
Axis make_axis(double low, double high, bool round_out) {
    if (!(high > low)) {
        const double margin = low == 0 ? 1 : std::abs(low) * 0.05;
        low -= margin;
        high += margin;
    }
    const double raw = (high - low) / 4;
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

std::string chart_grid(const Axes& axes, const Chart& chart) {
    std::string svg;
    const double left = kChart.left, right = kChart.width - kChart.right;
    const double bottom = kChart.height - kChart.bottom;
    for (double v : axes.y.ticks())
        svg += fmt::format(
            "<line class=\"grid\" x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\"/>"
            "<text class=\"tick\" text-anchor=\"end\" x=\"{3}\" y=\"{4:.1f}\">{5}</text>\n",
            left, right, axes.py(v), left - 6, axes.py(v) + 4, short_number(v, 4));
    for (double v : axes.x.ticks())
        svg += fmt::format(
            "<line class=\"axis\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\"/>"
            "<text class=\"tick\" text-anchor=\"middle\" x=\"{0:.1f}\" y=\"{3}\">{4}</text>\n",
            axes.px(v), bottom, bottom + 4, bottom + 17, short_number(v, 4));
    svg += fmt::format("<line class=\"axis\" x1=\"{0}\" x2=\"{1}\" y1=\"{2}\" y2=\"{2}\"/>\n", left, right,
                       bottom);
    return svg + fmt::format("<text class=\"label\" text-anchor=\"middle\" x=\"{}\" y=\"{}\">{}</text>\n",
                             (left + right) / 2, kChart.height - 6,
                             escape_html(chart.x_name + (chart.x_unit.empty() ? "" : ", ") + chart.x_unit));
}

/// The mean over a window of a tenth of the points: losses differ much between views. The window is centred, but at the
/// end, where curves are flat, it keeps the points before.
std::vector<ChartPoint> running_mean(const std::vector<ChartPoint>& points) {
    const size_t half = points.size() / 20;
    std::vector<ChartPoint> mean(points);
    for (size_t i = 0; i < points.size(); ++i) {
        const size_t before = std::min(half, i), after = std::min(before, points.size() - 1 - i);
        double sum = 0;
        for (size_t j = i - before; j <= i + after; ++j) sum += points[j].y;
        mean[i].y = sum / double(before + after + 1);
    }
    return mean;
}

// More values under the pointer could not be distinguished.
constexpr size_t kMostBands = 300;

/// The finite ones.
std::vector<ChartPoint> finite(std::vector<ChartPoint> points) {
    std::erase_if(points, [](const ChartPoint& p) { return !std::isfinite(p.x) || !std::isfinite(p.y); });
    return points;
}

std::string dots(const Axes& axes, const std::vector<ChartPoint>& points, const char* css) {
    std::string svg;
    for (const ChartPoint& p : points)
        svg += fmt::format("<circle class=\"{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\"/>", css, axes.px(p.x),
                           axes.py(p.y));
    return svg;
}

/// The values at one x.
struct Band {
    double x = 0;
    std::vector<ChartPoint> first, second;  // none or one each
    double mean = 0;
};

/// The values of both series by x, evenly thinned out.
std::vector<Band> bands_of(const Chart& chart, const std::vector<ChartPoint>& mean) {
    std::vector<Band> bands;
    for (size_t i = 0; i < chart.points.size(); ++i)
        bands.push_back({chart.points[i].x, {chart.points[i]}, {}, chart.smooth ? mean[i].y : 0});
    for (const ChartPoint& p : chart.second) {
        const auto at = std::lower_bound(bands.begin(), bands.end(), p.x,
                                         [](const Band& band, double x) { return band.x < x; });
        if (at != bands.end() && at->x == p.x)
            at->second = {p};
        else
            bands.insert(at, {p.x, {}, {p}, 0});
    }
    const size_t every = (bands.size() + kMostBands - 1) / kMostBands;
    std::vector<Band> some;
    for (size_t i = 0; i < bands.size(); ++i)
        if (i % every == 0 || i + 1 == bands.size()) some.push_back(bands[i]);
    return some;
}

std::string with_unit(double value, const std::string& unit) {
    const std::string number =
        std::abs(value) < 1000 ? fmt::format("{:.4g}", value) : fmt::format("{:.0f}", value);
    return number + (unit.empty() ? "" : " ") + escape_html(unit);
}

std::string band_text(const Chart& chart, const Band& band) {
    std::string text = escape_html(chart.x_name) + " " + with_unit(band.x, chart.x_unit) + ": ";
    if (!band.first.empty()) {
        text += with_unit(band.first[0].y, chart.y_unit);
        if (chart.smooth) text += ", mean " + with_unit(band.mean, "");
    }
    if (!band.second.empty())
        text += band.first.empty() ? "held out " + with_unit(band.second[0].y, chart.y_unit)
                                   : ", held out " + with_unit(band.second[0].y, "");
    return text;
}

/// Invisible columns that show the values at their x: by themselves in a tooltip, with scripts in the readout.
std::string bands_svg(const Axes& axes, const Chart& chart, const std::vector<Band>& bands) {
    const double left = kChart.left, right = kChart.width - kChart.right;
    const double top = kChart.top, bottom = kChart.height - kChart.bottom;
    std::string svg;
    for (size_t i = 0; i < bands.size(); ++i) {
        const double x = axes.px(bands[i].x);
        const double from = i == 0 ? left : (axes.px(bands[i - 1].x) + x) / 2;
        const double to = i + 1 == bands.size() ? right : (x + axes.px(bands[i + 1].x)) / 2;
        svg += fmt::format("<g class=\"band\"><rect x=\"{:.1f}\" y=\"{}\" width=\"{:.1f}\" height=\"{}\"/>",
                           from, top, std::max(0.1, to - from), bottom - top);
        svg += fmt::format("<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\"/>", x, top, bottom);
        svg += dots(axes, bands[i].first, "dot") + dots(axes, bands[i].second, "second dot");
        svg += "<title>" + band_text(chart, bands[i]) + "</title></g>\n";
    }
    return svg;
}

std::string caption(const Chart& chart) {
    std::string html = "<figcaption>" + escape_html(chart.title);
    if (!chart.y_unit.empty()) html += " <span>" + escape_html(chart.y_unit) + "</span>";
    if (!chart.name.empty()) html += "<br><span class=\"key\">" + escape_html(chart.name) + "</span>";
    if (!chart.second.empty())
        html += "<br><span class=\"key second\">" + escape_html(chart.second_name) + "</span>";
    return html + "</figcaption>\n";
}

// Distinct for readers who cannot tell red from green (Okabe and Ito 2008).
constexpr const char* kColors[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                   "#e69f00", "#56b4e9", "#8c6d31"};

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

std::string work_grid(const Axes& axes, const WorkPrecision& diagram) {
    const double left = kWork.left, right = kWork.width - kWork.right;
    const double top = kWork.top, bottom = kWork.height - kWork.bottom;
    std::string svg = fmt::format("<text x=\"{}\" y=\"20\" font-weight=\"600\" font-size=\"15\">{}</text>\n",
                                  left, escape_html(diagram.title));
    const auto line = [](double x1, double y1, double x2, double y2) {
        return fmt::format(
            "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#8a8f94\" "
            "stroke-opacity=\"0.4\"/>",
            x1, y1, x2, y2);
    };
    for (const double tick : axes.x.ticks()) {
        const double x = axes.px(tick);
        svg += line(x, top, x, bottom) +
               fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{:g}</text>\n", x, bottom + 18,
                           tick);
    }
    for (const double tick : axes.y.ticks()) {
        const double y = axes.py(tick);
        svg += line(left, y, right, y) +
               fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{:g}</text>\n", left - 6, y + 4,
                           tick);
    }
    return svg + fmt::format(
                     "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n"
                     "<text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                     (left + right) / 2, kWork.height - 10, escape_html(diagram.x_label), (top + bottom) / 2,
                     escape_html(diagram.y_label));
}

std::string series_svg(const Axes& axes, const WorkSeries& series, size_t number) {
    const char* color = kColors[(series.hue < 0 ? number : size_t(series.hue)) % std::size(kColors)];
    const std::string dot = series.dashed
                                ? fmt::format("fill=\"none\" stroke=\"{}\" stroke-width=\"2\"", color)
                                : fmt::format("fill=\"{}\"", color);
    std::string path, dots;
    for (const WorkPoint& p : series.points) {
        if (!shown(p)) continue;
        const double x = axes.px(p.time), y = axes.py(p.error);
        path += fmt::format("{:.1f},{:.1f} ", x, y);
        dots += fmt::format(
            "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" {}><title>{}: {:.3g}, {:.3g}</title>"
            "</circle>\n",
            x, y, series.dashed ? 3 : 4, dot, escape_html(series.name + ", " + p.name), p.time, p.error);
    }
    std::string svg;
    if (series.line)
        svg +=
            fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"{}/>\n", path,
                        color, series.dashed ? 1.5 : 2, series.dashed ? " stroke-dasharray=\"5 4\"" : "");
    const double x = kWork.width - kWork.right, y = kWork.top + 14 + 22 * double(number);
    return svg + dots +
           fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"{}\" {}/><text x=\"{}\" y=\"{}\">{}</text>\n", x + 18,
                       y - 4, series.dashed ? 3 : 4, dot, x + 28, y, escape_html(series.name));
}

}  // namespace

std::string short_number(double value, int digits) {
    if (!std::isfinite(value)) return std::isnan(value) ? "n/a" : value > 0 ? "∞" : "-∞";
    static constexpr const char* kSuffix[] = {"", "k", "M", "G", "T"};
    int thousands = 0;
    for (; std::abs(value) >= 1000 && thousands < 4; ++thousands) value /= 1000;
    return fmt::format("{:.{}g}{}", value == 0 ? 0.0 : value, digits, kSuffix[thousands]);
}

std::string chart_svg(const Chart& given) {
    Chart chart = given;
    chart.points = finite(given.points);
    chart.second = finite(given.second);
    std::vector<ChartPoint> all = chart.points;
    all.insert(all.end(), chart.second.begin(), chart.second.end());
    if (all.size() < 2) return "";

    const auto lower = [](auto& a, auto& b) { return a.y < b.y; };
    const auto earlier = [](auto& a, auto& b) { return a.x < b.x; };
    const auto [low, high] = std::minmax_element(all.begin(), all.end(), lower);
    const auto [first, last] = std::minmax_element(all.begin(), all.end(), earlier);
    const Axes axes{kChart, make_axis(std::min(0.0, first->x), last->x, false),
                    make_axis(chart.zero_based ? std::min(0.0, low->y) : low->y, high->y, true)};
    const std::vector<ChartPoint> mean = running_mean(chart.points);
    const std::vector<Band> bands = bands_of(chart, mean);
    std::string svg =
        "<figure class=\"chart\">" + caption(chart) +
        fmt::format(
            "<p class=\"readout\">{}</p>\n<svg viewBox=\"0 0 {} {}\" role=\"img\" "
            "aria-label=\"{}\">\n",
            band_text(chart, bands.back()), kChart.width, kChart.height, escape_html(chart.title));
    svg += chart_grid(axes, chart);
    svg += polyline(axes, chart.points, chart.smooth ? "raw" : "line");
    if (chart.smooth) svg += polyline(axes, mean, "line");
    if (chart.points.size() <= 30 && !chart.smooth) svg += dots(axes, chart.points, "dot");
    if (chart.second.size() > 1) svg += polyline(axes, chart.second, "second");
    if (chart.second.size() <= 30) svg += dots(axes, chart.second, "second dot");
    return svg + bands_svg(axes, chart, bands) + "</svg></figure>\n";
}

std::string work_precision_svg(const WorkPrecision& diagram) {
    std::vector<double> times, errors;
    for (const WorkSeries& series : diagram.series)
        for (const WorkPoint& p : series.points) {
            if (!shown(p)) continue;
            times.push_back(p.time);
            errors.push_back(p.error);
        }
    if (times.size() < 2) return "";
    const Axis powers{true, 0, 1, 1}, decibels{false, 0, 1, 2};
    const Axes axes{kWork, whole_steps(times, powers),
                    whole_steps(errors, diagram.decibels ? decibels : powers)};
    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
        "role=\"img\" aria-label=\"{2}\" font-family=\"system-ui, DejaVu Sans, sans-serif\" font-size=\"12\" "
        "fill=\"#70777d\">\n",
        kWork.width, kWork.height, escape_html(diagram.title));
    svg += work_grid(axes, diagram);
    for (size_t i = 0; i < diagram.series.size(); ++i) svg += series_svg(axes, diagram.series[i], i);
    return svg + "</svg>\n";
}

}  // namespace ewa::report
