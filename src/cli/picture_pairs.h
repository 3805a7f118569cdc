// SPDX-License-Identifier: Apache-2.0
// Which picture is compared with which.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace ewa::cli {

struct PicturePair {
    std::string name;  // without extension, relative to the folders; empty for two files
    std::filesystem::path a, b;
};

struct PicturePairs {
    std::vector<PicturePair> pairs;               // at least one
    std::vector<std::filesystem::path> unpaired;  // of either folder
};

/// Two files, or the files of two folders: those of one name, then those of one name but for the extension
/// (what ewa render writes is named like the photographs). Throws InputError where there is nothing to
/// compare.
PicturePairs pair_pictures(const std::filesystem::path& a, const std::filesystem::path& b);

}  // namespace ewa::cli
