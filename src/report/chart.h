// SPDX-License-Identifier: Apache-2.0
// Diagrams as inline SVG: line charts in the colours of the page around them, and error against run time,
// which compares methods of different cost.
#pragma once
#include <string>
#include <vector>

#include "core/html.h"
#include "report/work_precision.h"

namespace ewa::report {

using core::escape_html;

/// A number with at most `digits` significant digits, and k, M, G above a thousand.
std::string short_number(double value, int digits = 3);

struct ChartPoint {
    double x = 0, y = 0;
};

struct Chart {
    std::string title, x_name, x_unit = "", y_unit = "";
    std::vector<ChartPoint> points = {};  // in the order of x; points that are not finite are skipped
    bool smooth = false;                  // draw a running mean, with the points faint behind it
    bool zero_based = false;              // the y axis starts at 0; the x axis always does
    std::string name = "";                // what the points are
    std::vector<ChartPoint> second = {};  // another series, as dots; in the order of x
    std::string second_name = "";
};

/// A <figure> with one chart that tells the values under the pointer; empty if fewer than two points are finite.
std::string chart_svg(const Chart& chart);

/// An SVG file with colours for light and dark pages; each point shows its name under the pointer. Points
/// whose time or error is not positive and finite are skipped. Empty if fewer than two points remain.
std::string work_precision_svg(const WorkPrecision& diagram);

}  // namespace ewa::report
