// SPDX-License-Identifier: Apache-2.0
// The files of ewa convert: those that a scene consists of besides the one that names it.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

namespace ewa::cli {

/// The files that hold the values of an existing .gltf, meta.json or lod-meta.json; empty for other formats.
std::vector<std::filesystem::path> values_of(const std::filesystem::path& path);

uint64_t bytes_of(const std::vector<std::filesystem::path>& files);

/// Throws InputError if an input is one of the parts that `out` writes: a chunk in a folder N_M of a lod-meta.json, or a tile of a
/// tileset.json.
void check_not_a_part(const std::filesystem::path& out, const std::filesystem::path& input);

/// What the output is, for messages.
std::string_view format_text(const std::filesystem::path& out);

}  // namespace ewa::cli
