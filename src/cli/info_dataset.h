// SPDX-License-Identifier: Apache-2.0
// What ewa info prints of a dataset, as text or as JSON. Both functions throw InputError.
#pragma once
#include <filesystem>

namespace ewa::cli {

/// A COLMAP folder or a transforms.json. test_every: the K of --test-every.
void info_dataset(const std::filesystem::path& path, int test_every, bool json);

/// A glTF file of meshes, and the views that `ewa train` renders of it.
void info_mesh(const std::filesystem::path& path, int test_every, bool json);

}  // namespace ewa::cli
