// SPDX-License-Identifier: Apache-2.0
// What ewa eval --depth prints and writes.
#pragma once
#include <string>

#include "report/summary.h"
#include "run/depth_evaluation.h"

namespace ewa::cli {

/// A row an image and one of means, in percent. Empty without images.
std::string depth_table(const train::DepthEvaluation& evaluation);

/// Adds "depth" at the top, and to each of "frames" that has it. json: that of ewa eval.
void add_depths(report::Json& json, const train::DepthEvaluation& evaluation);

}  // namespace ewa::cli
