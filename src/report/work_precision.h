// SPDX-License-Identifier: Apache-2.0
// Error against run time: the diagram in which methods of different price compare.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace ewa::report {

struct WorkPoint {
    std::string name;  // e.g. "16 samples"
    double time = 0;   // as x_label says
    double error = 0;  // as y_label says
    double worst = 0;  // the largest single one; 0: not known
};

struct WorkSeries {
    std::string name;   // e.g. "ray-marcher"
    bool line = false;  // the points are one thing done more and more thoroughly
    std::vector<WorkPoint> points;
};

struct WorkPrecision {
    std::string title, x_label = "ms a frame", y_label = "RMS error";
    bool decibels = false;           // the error is a PSNR, drawn evenly; else both axes are in powers of ten
    std::vector<std::string> notes;  // one line each: what was measured, where and how
    std::vector<WorkSeries> series;
};

/// A file of its own: colours that read on light and dark pages, every point with its name on hovering.
/// Points without a finite positive time and error are left out; empty where fewer than two are left.
std::string work_precision_svg(const WorkPrecision& diagram);

/// The diagram, its notes and a table of its points, for the report.
std::string work_precision_html(const WorkPrecision& diagram);

nlohmann::ordered_json work_precision_json(const WorkPrecision& diagram);

}  // namespace ewa::report
