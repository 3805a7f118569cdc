// SPDX-License-Identifier: Apache-2.0
// Line charts as inline SVG in the colours of the page around them, and the axes that all diagrams use.
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace ewa::report {

/// The text as HTML or attribute content: escapes & < > " ' and drops control characters.
std::string escape_html(std::string_view text);

/// A number with at most `digits` significant digits, and k, M, G above a thousand.
std::string short_number(double value, int digits = 3);

/// One axis of a diagram: linear, or in powers of ten.
struct Axis {
    bool logarithmic = false;
    double low = 0, high = 1, tick = 1;  // of a logarithmic axis: exponents

    /// The position of a value: 0 at the start of the axis, 1 at its end.
    double share(double value) const { return (place(value) - low) / (high - low); }
    std::vector<double> ticks() const;
    double place(double value) const;
};

/// The axes of a diagram, and the rectangle that they span in a drawing of this size.
struct Axes {
    Axis x, y;
    double width = 0, height = 0, left = 0, right = 0, top = 0, bottom = 0;  // margins

    double px(double v) const { return left + x.share(v) * (width - left - right); }
    double py(double v) const { return height - bottom - y.share(v) * (height - top - bottom); }
};

struct ChartPoint {
    double x = 0, y = 0;
};

struct Chart {
    std::string title, x_label, y_label;
    std::vector<ChartPoint> points;  // in the order of x; points that are not finite are skipped
    bool smooth = false;             // draw a running mean, with the points faint behind it
    bool zero_based = false;         // the y axis starts at 0; the x axis always does
};

/// A <figure> with one chart; empty if fewer than two points are finite.
std::string chart_svg(const Chart& chart);

}  // namespace ewa::report
