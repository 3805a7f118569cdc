// SPDX-License-Identifier: Apache-2.0
// The report of a training run: one self-contained HTML file.
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "ewa/plan.h"
#include "report/step_time.h"
#include "report/summary.h"
#include "report/views.h"

namespace ewa::report {

/// The points that determine an image's camera: CameraSupport.
struct CameraRow {
    std::string name;
    size_t points = 0;
    double error = 0;      // px; 0: not known
    std::string together;  // the images that see most of the same points
};

struct ReportData {
    std::string title;  // the dataset's name
    Summary summary;
    std::vector<MetricsLine> metrics;
    StepTime times;
    int earlier_steps = 0;  // of the run that this one continues: `times` has those after them
    std::vector<PlanLine> plan;
    std::vector<std::string> notes;                             // e.g. "at most 500000 splats: ..."
    std::vector<std::string> remarks;                           // warnings, e.g. "3 images are missing"
    std::vector<std::pair<std::string, std::string>> settings;  // name, value
    std::vector<ReportView> views;                              // sorted
    std::vector<LeftOutView> left_out;                          // training images, the most first
    std::vector<CameraRow> cameras;                             // the largest error first
    bool held_out = true;                                       // the views were not trained on
};

/// The report as HTML. Escapes every string. Skips parts without data.
std::string html_report(const ReportData& data);

}  // namespace ewa::report
