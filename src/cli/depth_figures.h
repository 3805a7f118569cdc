// SPDX-License-Identifier: Apache-2.0
// What ewa eval --depth prints and writes.
#pragma once
#include <string>

#include "report/summary.h"
#include "run/depth_evaluation.h"

namespace ewa::cli {

/// A table of depth errors in percent, with one row for each image, and one for their means. Empty without images.
std::string depth_table(const train::DepthEvaluation& evaluation);

/// Adds the member "depth" to the JSON of ewa eval: to the whole, and to each of its "frames" whose depth was measured.
void add_depths(report::Json& json, const train::DepthEvaluation& evaluation);

}  // namespace ewa::cli
