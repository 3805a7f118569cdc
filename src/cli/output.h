// SPDX-License-Identifier: Apache-2.0
// Writing what the user asked for.
#pragma once
#include <filesystem>
#include <string>

#include "report/summary.h"

namespace ewa::cli {

/// Creates the folder and its parents. Throws RunError when it cannot be, or is something else.
void make_folder(const std::filesystem::path& folder);

/// Pretty-printed, in one piece or not at all; the file's folder is made. Throws RunError.
void write_json(const std::filesystem::path& path, const report::Json& json);

}  // namespace ewa::cli
