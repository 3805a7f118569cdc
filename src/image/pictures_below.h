// SPDX-License-Identifier: Apache-2.0
// The pictures of a folder.
#pragma once
#include <filesystem>
#include <vector>

namespace ewa::image {

/// Files below the folder, subfolders included, whose extension is one that OpenImageIO reads; relative to
/// the folder, sorted. Links to folders are not followed. Throws InputError where a folder cannot be read.
std::vector<std::filesystem::path> pictures_below(const std::filesystem::path& folder);

}  // namespace ewa::image
