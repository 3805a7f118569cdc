// SPDX-License-Identifier: Apache-2.0
// The report of a training run: one self-contained HTML file.
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "ewa/image.h"
#include "ewa/plan.h"
#include "report/summary.h"

namespace ewa::report {

struct ReportPicture {
    std::string name;
    Image original, rendering;  // RGB, of equal size
    double psnr = 0, ssim = 0;
};

struct NamedTime {
    std::string name;
    double milliseconds = 0;
};

struct ReportData {
    std::string title;  // the dataset's name
    Summary summary;
    std::vector<MetricsLine> metrics;
    std::vector<NamedTime> pass_times;  // of one step, in order
    std::vector<PlanLine> plan;
    std::vector<std::string> remarks;                           // e.g. "3 images are missing"
    std::vector<std::pair<std::string, std::string>> settings;  // name, value
    std::vector<ReportPicture> pictures;
    std::string section;   // HTML that the report contains as it is
    bool held_out = true;  // the pictures were not trained on
};

/// Escapes every string but `section`. A part without data is skipped.
std::string html_report(const ReportData& data);

/// A page in the style of the report. Escapes the title; `body` is HTML.
std::string html_page(const std::string& title, const std::string& body);

}  // namespace ewa::report
