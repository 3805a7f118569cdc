// SPDX-License-Identifier: Apache-2.0
// Error against run time, which compares methods of different cost. It needs no formatting library, which ewa-bench does not link.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

namespace ewa::report {

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

/// The diagram's numbers and texts as JSON, without the style in which series are drawn.
nlohmann::ordered_json work_precision_json(const WorkPrecision& diagram);

}  // namespace ewa::report
