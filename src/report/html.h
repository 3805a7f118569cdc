// The report of a training run: one HTML file that needs nothing beside it.
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "ewa/image.h"
#include "ewa/renderer.h"
#include "report/summary.h"

namespace ewa::report {

struct ReportPicture {
    std::string name;
    Image photograph, rendering;  // RGB, of one size
    double psnr = 0, ssim = 0;
};

struct ReportData {
    std::string title;  // the dataset's name
    Summary summary;
    std::vector<MetricsLine> metrics;
    std::vector<PassTime> pass_times;
    std::vector<PlanLine> plan;
    std::vector<std::string> remarks;                           // e.g. "3 images are missing"
    std::vector<std::pair<std::string, std::string>> settings;  // name, value
    std::vector<ReportPicture> pictures;
    bool held_out = true;  // the pictures were not trained on
};

/// Every string is escaped; a part without data is left out.
std::string html_report(const ReportData& data);

}  // namespace ewa::report
