// SPDX-License-Identifier: Apache-2.0
// The table of a stability run as text and JSON.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "bench/stability/case_errors.h"

namespace ewa::bench {

std::string stability_header();
std::string stability_line(const StabilityResult& result);
std::string stability_training_header();
std::string stability_training_line(const StabilityTraining& training);

nlohmann::ordered_json stability_json(const std::vector<StabilityResult>& results,
                                      const std::vector<StabilityTraining>& trainings);

}  // namespace ewa::bench
