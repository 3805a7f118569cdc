// SPDX-License-Identifier: Apache-2.0
// Line charts as inline SVG, drawn in the colours of the page that holds them.
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace ewa::report {

/// Text as HTML or attribute content: & < > " ' escaped, control characters dropped.
std::string escape_html(std::string_view text);

/// A number for people: at most `digits` significant digits, with k, M, G above a thousand.
std::string short_number(double value, int digits = 3);

struct ChartPoint {
    double x = 0, y = 0;
};

struct Chart {
    std::string title, x_label, y_label;
    std::vector<ChartPoint>
        points;           // in the order of x, which is drawn from 0; points that are not finite are left out
    bool smooth = false;  // draws a running mean over the points, these faint behind it
    bool zero_based = false;  // the y axis starts at 0
};

/// A <figure> with one chart; empty where fewer than two points are finite.
std::string chart_svg(const Chart& chart);

}  // namespace ewa::report
