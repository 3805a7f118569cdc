// SPDX-License-Identifier: Apache-2.0
// Diagrams as inline SVG: line charts in the colours of the page around them, and error against run time,
// which compares methods of different cost.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/html.h"

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

struct WorkPoint {
    std::string name;          // e.g. "16 samples"
    double time = 0;           // in the unit of x_label
    double error = 0;          // in the unit of y_label
    double worst = 0;          // the largest error of a pixel; 0: unknown
    std::string verdict = "";  // one line for a table
};

struct WorkSeries {
    std::string name;   // e.g. "ray-marcher"
    bool line = false;  // connect the points: one method with increasing effort
    std::vector<WorkPoint> points;
    bool dashed = false;  // and hollow points
    int hue = -1;         // series with the same number have one colour; -1: a colour of its own
};

/// A table of numbers: a name and some values a row.
struct WorkTable {
    std::string title;
    std::vector<std::string> columns;  // of the names, then of the values
    std::vector<std::pair<std::string, std::vector<double>>> rows;
    std::string note = "";  // what the columns are
};

struct WorkPrecision {
    std::string title, x_label = "ms a frame", y_label = "RMS error";
    bool decibels = false;           // the error is a PSNR on a linear axis; else both axes are logarithmic
    std::vector<std::string> notes;  // one line each: what was measured, and how
    std::vector<WorkSeries> series;
    std::vector<WorkTable> tables = {};  // below the diagram
};

/// An SVG file with colours for light and dark pages; each point shows its name under the pointer. Points
/// whose time or error is not positive and finite are skipped. Empty if fewer than two points remain.
std::string work_precision_svg(const WorkPrecision& diagram);

nlohmann::ordered_json work_precision_json(const WorkPrecision& diagram);

}  // namespace ewa::report
