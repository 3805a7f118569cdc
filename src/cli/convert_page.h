// SPDX-License-Identifier: Apache-2.0
// ewa convert IN... page.html: a page that shows the scene in a browser.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/convert_output.h"
#include "ewa/splat_files.h"
#include "live/run_folder.h"

namespace ewa::cli {

/// Whether the name is that of a page: .html or .htm.
bool names_page(const std::filesystem::path& path);

/// The levels of an unbundled NAME.html: NAME-levels/lod-meta.json beside it.
std::filesystem::path levels_of_page(const std::filesystem::path& page);

/// Writes the page with the scene inside, or unbundled with levels_of_page(), of options.levels. output: of which the page takes
/// `unbundled` and `title`. run: its dataset's cameras become the
/// views of the page, and its background is the page's; empty: none. Returns a line for each thing that the page does not have. Throws
/// InputError, RunError.
std::vector<std::string> write_page(const std::filesystem::path& path, Gaussians gaussians,
                                    const SaveOptions& options, const std::optional<live::Run>& run,
                                    const OutputOptions& output);

}  // namespace ewa::cli
