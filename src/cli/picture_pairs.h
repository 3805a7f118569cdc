// SPDX-License-Identifier: Apache-2.0
// Which picture is compared with which.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "cli/compared_side.h"

namespace ewa::cli {

struct PicturePair {
    std::string name;  // without extension; empty for two files
    std::filesystem::path a, b;
};

struct PicturePairs {
    std::vector<PicturePair> pairs;             // at least one
    std::vector<std::filesystem::path> only_a;  // asked for, and without a partner
    std::vector<std::filesystem::path> only_b;
};

/// Those of one name, then those of one name but for the extension (what ewa render writes is named like the
/// photographs). What a side has and was not asked for takes its partner with it. One picture goes with
/// another, or with the only one that a scene is asked for. Throws InputError where there is nothing to
/// compare.
PicturePairs pair_pictures(const SideNames& a, const SideNames& b);

}  // namespace ewa::cli
