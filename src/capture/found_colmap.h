// SPDX-License-Identifier: Apache-2.0
// Where COLMAP is on this system: the program `colmap`, or the package pycolmap of a Python.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace ewa::capture {

/// A COLMAP of this system.
struct FoundColmap {
    std::vector<std::string> words;  // that its command lines begin with
    std::string name;                // for the user: "/usr/bin/colmap", "pycolmap 4.2.0 of /usr/bin/python3"
};

/// The program `colmap` in PATH, else a Python 3 with pycolmap: `python` unless it is empty, then that of VIRTUAL_ENV, then that of PATH.
std::optional<FoundColmap> find_colmap(const std::filesystem::path& python = {});

/// As find_colmap(). Throws RunError with the command that installs COLMAP if there is none.
FoundColmap require_colmap(const std::filesystem::path& python);

}  // namespace ewa::capture
