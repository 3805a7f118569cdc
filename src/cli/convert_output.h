// SPDX-License-Identifier: Apache-2.0
// The output of ewa convert: the options that only some outputs have, and what it takes from a run.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "live/run_folder.h"
#include "report/scene_output.h"

namespace CLI {
class App;
}

namespace ewa::cli {

using report::levels_of_page;
using report::names_page;
using report::names_tileset;
using report::OutputOptions;
using ConvertOutput = report::SceneOutput;

void add_output_options(CLI::App& app, OutputOptions& options);

/// Throws InputError where the output cannot be read back.
void check_readable(const ConvertOutput& output);

/// What the page of a run shows: its dataset's cameras, and its background. run: empty: none. Adds a remark where they cannot be read.
report::PageCameras page_cameras(const std::optional<live::Run>& run, std::vector<std::string>& remarks);

}  // namespace ewa::cli
