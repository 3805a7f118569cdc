// SPDX-License-Identifier: Apache-2.0
// Folders and JSON files that a command writes.
#pragma once
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace ewa::core {

/// Creates the folder and its parents. An empty path names no folder. Throws RunError if the folder cannot be
/// created, or if the path names something else.
void make_folder(const std::filesystem::path& folder);

/// Writes the value with two spaces of indentation, as write_text_file does. Creates the file's folder. Bytes
/// that are not UTF-8 become U+FFFD. Throws RunError.
void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& json);

}  // namespace ewa::core
