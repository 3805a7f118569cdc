// SPDX-License-Identifier: Apache-2.0
// Rows of the options' table that the help does not show: learning rates, thresholds and intervals.
#pragma once
#include <vector>

#include "run/run_option.h"

namespace ewa::train {

/// The rows of the advanced options, which docs/training_options.md lists.
std::vector<RunOption> advanced_options();

}  // namespace ewa::train
