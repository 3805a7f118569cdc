// SPDX-License-Identifier: Apache-2.0
// The edits of ewa convert: the rows of src/edit/ as options, in the order in which they are typed.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "edit/edits.h"
#include "folders/run.h"

namespace CLI {
class App;
}

namespace ewa::cli {

struct EditArguments {
    std::vector<edit::Edit> edits;
    std::vector<std::filesystem::path> journals;  // whose edits are among them
    std::filesystem::path picture;  // image of the splats that would be removed, with --dry-run; empty: none
};

/// The edits that the parsed command line names, in the order in which they were typed. Throws InputError for a wrong value.
std::vector<edit::Edit> typed_edits(const CLI::App& app);

/// The cameras and photos of the run, which some filters of splats use. Empty without a run. remarks: lives as long as the result, and
/// gets a line for each comparison with the photos, whose progress is printed unless quiet.
edit::Cameras cameras_of(const std::optional<folders::Run>& run, std::vector<std::string>& remarks,
                         bool quiet);

/// Writes an image of the splats `all`: removed ones in red, others in grey. left: indices into `all` of those not removed.
/// Throws RunError.
void draw_removed(const std::filesystem::path& picture, const Gaussians& all,
                  const std::vector<uint32_t>& left, const std::optional<folders::Run>& run);

}  // namespace ewa::cli
