// SPDX-License-Identifier: Apache-2.0
// The diagram of error against run time, which compares methods of different cost.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace ewa::report {

struct WorkPoint {
    std::string name;  // e.g. "16 samples"
    double time = 0;   // in the unit of x_label
    double error = 0;  // in the unit of y_label
    double worst = 0;  // the largest error of a pixel; 0: unknown
};

struct WorkSeries {
    std::string name;   // e.g. "ray-marcher"
    bool line = false;  // connect the points: one method with increasing effort
    std::vector<WorkPoint> points;
};

struct WorkPrecision {
    std::string title, x_label = "ms a frame", y_label = "RMS error";
    bool decibels = false;           // the error is a PSNR on a linear axis; else both axes are logarithmic
    std::vector<std::string> notes;  // one line each: what was measured, and how
    std::vector<WorkSeries> series;
};

/// An SVG file with colours for light and dark pages; each point shows its name under the pointer. Points
/// whose time or error is not positive and finite are skipped. Empty if fewer than two points remain.
std::string work_precision_svg(const WorkPrecision& diagram);

/// The diagram with its notes and a table of its points, for the report.
std::string work_precision_html(const WorkPrecision& diagram);

nlohmann::ordered_json work_precision_json(const WorkPrecision& diagram);

}  // namespace ewa::report
