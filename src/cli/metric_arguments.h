// SPDX-License-Identifier: Apache-2.0
// The metrics of ewa eval and ewa compare beside PSNR and SSIM: their tables and JSON.
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "ewa/evaluation.h"
#include "report/summary.h"

namespace ewa::cli {

/// The metric that is printed beside PSNR where the exposure of an image is not known.
inline constexpr const char* kFittedMetric = "fitted_psnr";

struct MetricArguments {
    std::string metrics;  // a list; empty: none
    std::string protocol = "ewa";
    bool fitted = false;  // kFittedMetric is measured, too, unless the protocol is another program's

    /// Throws InputError.
    Measures measures() const;
};

/// The figures of an image, or their means.
struct FigureRow {
    std::string name;
    std::vector<Figure> figures;  // the same metrics in each row
};
/// A table with one line for each row, split into blocks of columns that fit a terminal. Empty without figures.
std::string figure_table(const std::vector<FigureRow>& rows);
/// "cc_psnr 24.312, flip 0.08123"; empty without figures.
std::string figures_text(const std::vector<Figure>& figures);

/// Adds each figure to the JSON object, under its name. A figure that is not finite becomes null.
void add_figures(report::Json& json, const std::vector<Figure>& figures);

}  // namespace ewa::cli
