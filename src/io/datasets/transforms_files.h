// SPDX-License-Identifier: Apache-2.0
// The files of a dataset that transforms.cpp reads, under the names that programs and people give them.
#pragma once
#include <filesystem>
#include <vector>

namespace ewa::io {

/// Those of the folder: transforms.json, else transforms_train.json, _test and _val, and then others that have frames. In any case.
std::vector<std::filesystem::path> transforms_files(const std::filesystem::path& folder);

/// Those of the first folder below that has some. Empty if several folders are datasets.
std::vector<std::filesystem::path> transforms_files_below(const std::filesystem::path& root);

}  // namespace ewa::io
