// SPDX-License-Identifier: Apache-2.0
// Writing what the user asked for.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "core/output.h"
#include "report/summary.h"

namespace ewa::cli {

using core::make_folder;
using core::write_json;

/// Whether the folder of a file that is to be written is made where it is missing.
enum class Folder { there, made };

/// Throws RunError, as writing the file would: said before long work, not after it. Changes nothing.
void check_writable(const std::filesystem::path& file, Folder folder);

/// A file, and what it is to the user: an argument or an option.
struct NamedFile {
    std::string name;
    std::filesystem::path path;  // empty: none
};

/// Throws InputError where `written` would take the place of one of the others, however each is spelled.
void keep_apart(const NamedFile& written, const std::vector<NamedFile>& others);
/// Several, of each other too.
void keep_apart(const std::vector<NamedFile>& written, const std::vector<NamedFile>& others);

}  // namespace ewa::cli
