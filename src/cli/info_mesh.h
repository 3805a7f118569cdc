// SPDX-License-Identifier: Apache-2.0
// ewa info of a mesh scene.
#pragma once
#include <filesystem>

namespace ewa::cli {

/// Prints what `ewa train` would photograph. Throws InputError.
void info_mesh(const std::filesystem::path& path, int test_every, bool json);

}  // namespace ewa::cli
