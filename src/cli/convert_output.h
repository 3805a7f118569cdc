// SPDX-License-Identifier: Apache-2.0
// The output of ewa convert: the options that only some outputs have, and what it takes from a run.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "folders/run.h"
#include "io/splats/output_options.h"

namespace CLI {
class App;
}

namespace ewa::cli {

void add_output_options(CLI::App& app, io::OutputOptions& options);

/// Lets the page of a run show its dataset's cameras, which `cameras` holds, and its background. Adds a remark where they cannot be read.
void show_run(const folders::Run& run, Dataset& cameras, PageOptions& page,
              std::vector<std::string>& remarks);

}  // namespace ewa::cli
