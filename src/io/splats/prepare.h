// SPDX-License-Identifier: Apache-2.0
// Changes a scene to what a file of a format stores (format_table.h). Functions return lines for the user on lost contents.
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

/// Removes splats that the file will not have, and puts the others into its order. So the file, when read back, can be compared
/// splat by splat. Positions and opacities do not change.
std::vector<std::string> match_file(Gaussians& gaussians, const FormatRow& row);

/// A line on comments and the anti-aliased mark, if the format cannot store them.
std::vector<std::string> dropped_remarks(const SaveOptions& options, const FormatRow& row);

}  // namespace ewa::io
