// SPDX-License-Identifier: Apache-2.0
// The edits of ewa convert: the rows of src/edit/ as options, in the order in which they are typed.
#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "edit/edits.h"
#include "folders/run.h"

namespace CLI {
class App;
}

namespace ewa::cli {

struct EditArguments {
    std::vector<edit::Edit> edits;
    std::filesystem::path picture;  // of what would be removed, with --dry-run; empty: none
};

/// The edits of a command line that was parsed, in its order. Throws InputError for a value that cannot be read.
std::vector<edit::Edit> typed_edits(const CLI::App& app);

/// The cameras of the run, for filters. Empty without a run.
edit::Cameras cameras_of(const std::optional<folders::Run>& run);

/// Draws `all` in grey with what `left` lacks in red, and writes the picture. left: numbers of splats of `all`. Throws RunError.
void draw_removed(const std::filesystem::path& picture, const Gaussians& all,
                  const std::vector<uint32_t>& left, const std::optional<folders::Run>& run);

}  // namespace ewa::cli
