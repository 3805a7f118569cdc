// SPDX-License-Identifier: Apache-2.0
// What an output of ewa convert takes from a run.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/splat_scene.h"
#include "folders/run.h"

namespace ewa::cli {

/// Lets the page of a run show its dataset's cameras, which `cameras` holds, and its background. Adds a remark where they cannot be read.
void show_run(const folders::Run& run, Dataset& cameras, PageOptions& page,
              std::vector<std::string>& remarks);

}  // namespace ewa::cli
