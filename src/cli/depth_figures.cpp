// SPDX-License-Identifier: Apache-2.0
#include "cli/depth_figures.h"

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include <algorithm>

#include "core/text.h"

namespace ewa::cli {
namespace {

constexpr size_t kMostOfName = 36;  // with the columns, a line of 100 characters

std::string percents(const train::DepthErrors& errors) {
    return fmt::format(" {:7.3f} {:7.3f} {:7.2f} {:7.2f}", 100 * errors.median, 100 * errors.mean,
                       100 * errors.within_1, 100 * errors.within_5);
}

report::Json json_of_errors(const train::DepthErrors& errors) {
    return {{"median_error", errors.median},
            {"mean_error", errors.mean},
            {"within_1_percent", errors.within_1},
            {"within_5_percent", errors.within_5}};
}

report::Json both(const train::DepthErrors& median_depth, const train::DepthErrors& mean_depth) {
    return {{"median_depth", json_of_errors(median_depth)}, {"mean_depth", json_of_errors(mean_depth)}};
}

}  // namespace

std::string depth_table(const train::DepthEvaluation& evaluation) {
    size_t width = 4;
    for (const train::DepthFrame& frame : evaluation.frames)
        width = std::max(width, std::min(kMostOfName, core::one_line(frame.name).size()));
    const std::string columns = "  median    mean  in 1 %  in 5 %";
    std::string text = fmt::format("{:{}}{:>32}{:>32}\n{:{}}{}{}\n", "", width, "errors of median depth, %",
                                   "errors of mean depth, %", "", width, columns, columns);
    for (const train::DepthFrame& frame : evaluation.frames)
        text += fmt::format("{:{}}{}{}\n", core::one_line(frame.name), width, percents(frame.median_depth),
                            percents(frame.mean_depth));
    return text + fmt::format("{:{}}{}{}\n", "mean", width, percents(evaluation.median_depth),
                              percents(evaluation.mean_depth));
}

void add_depths(report::Json& json, const train::DepthEvaluation& evaluation) {
    json["depth"] = both(evaluation.median_depth, evaluation.mean_depth);
    json["depth"]["frames"] = evaluation.frames.size();
    for (report::Json& shown : json["frames"])
        for (const train::DepthFrame& frame : evaluation.frames)
            if (shown["name"] == frame.name) {
                shown["depth"] = both(frame.median_depth, frame.mean_depth);
                shown["depth"]["pixels"] = frame.pixels;
            }
}

}  // namespace ewa::cli
