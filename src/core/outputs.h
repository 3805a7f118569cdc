// SPDX-License-Identifier: Apache-2.0
// The rule for the files that a command writes. README.md states it for users.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace ewa::core {

/// A file with the argument or option that names it.
struct NamedFile {
    std::string name;
    std::filesystem::path path;  // empty: none
};

/// Checks the outputs of a command before its work, and clears the temporary files that killed commands left in
/// the folders of the outputs. Every command that writes files calls this with all of them.
/// - InputError if an output is the same file as an input or another output, also through links.
/// - RunError if an output could not be written: a folder cannot be created, or the path is not a regular file.
/// Missing folders are no error, and are not created yet.
void check_outputs(const std::vector<NamedFile>& written, const std::vector<NamedFile>& read);

}  // namespace ewa::core
