// SPDX-License-Identifier: Apache-2.0
// Writing files that the user asked for.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "core/folders.h"
#include "core/json.h"
#include "report/summary.h"

namespace ewa::cli {

using core::make_folder;
using core::write_json;

/// Whether a missing folder of an output file is created.
enum class Folder { there, made };

/// Throws RunError if the file could not be written, before long work instead of after it. Changes nothing.
void check_writable(const std::filesystem::path& file, Folder folder);

/// A file with the argument or option that names it.
struct NamedFile {
    std::string name;
    std::filesystem::path path;  // empty: none
};

/// Throws InputError if `written` is the same file as one of the others, however the paths are spelled.
void keep_apart(const NamedFile& written, const std::vector<NamedFile>& others);
/// The same for several files, which must also differ from each other.
void keep_apart(const std::vector<NamedFile>& written, const std::vector<NamedFile>& others);

}  // namespace ewa::cli
