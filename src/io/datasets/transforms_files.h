// SPDX-License-Identifier: Apache-2.0
// Finds the transforms.json files of a dataset, under the names that programs and people give them.
#pragma once
#include <filesystem>
#include <vector>

namespace ewa::io {

/// The transforms files in a folder, in order: transforms.json, transforms_train.json, _test, _val, then others that have frames.
/// Names may be in upper or lower case.
std::vector<std::filesystem::path> transforms_files(const std::filesystem::path& folder);

/// The transforms files of the first folder below `root` that has some. Empty if several folders are datasets.
std::vector<std::filesystem::path> transforms_files_below(const std::filesystem::path& root);

}  // namespace ewa::io
