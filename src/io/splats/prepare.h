// SPDX-License-Identifier: Apache-2.0
// The scene as a file of a format stores it (format_table.h). All functions return lines on contents that the format loses.
#pragma once
#include <string>
#include <vector>

#include "io/splats/format_table.h"

namespace ewa::io {

/// Changes the scene to what the format can store: float32 positions, opacities of 3DGS's kernel, and drawable splats only, unless
/// the row says that the format keeps more.
std::vector<std::string> prepare(Gaussians& gaussians, const FormatRow& row);

/// Whether prepare would leave the scene as it is.
bool is_prepared(const Gaussians& gaussians, const FormatRow& row);

/// Keeps the splats that the file will have, in its order, so that a file that is read back can be compared splat by splat. Positions
/// and opacities do not change.
std::vector<std::string> match_file(Gaussians& gaussians, const FormatRow& row);

/// The comments and the mark that the format drops.
std::vector<std::string> dropped_remarks(const SaveOptions& options, const FormatRow& row);

}  // namespace ewa::io
