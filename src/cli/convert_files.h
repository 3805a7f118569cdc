// SPDX-License-Identifier: Apache-2.0
// The files of ewa convert: those that a scene consists of besides the one that names it.
#pragma once
#include <cstdint>
#include <filesystem>
#include <vector>

namespace ewa::cli {

/// The files that hold the values of an existing file, such as those of a .gltf or meta.json; empty for formats of one file.
std::vector<std::filesystem::path> values_of(const std::filesystem::path& path);

/// The files that a written output consists of besides itself. unbundled: it is a page with its scene beside it.
std::vector<std::filesystem::path> parts_of(const std::filesystem::path& out, bool unbundled);

/// On the disk: hard links to one file count once.
uint64_t bytes_of(const std::vector<std::filesystem::path>& files);

/// Throws InputError if an input is one of the parts that `out` writes: a chunk in a folder N_M of a lod-meta.json, or a tile of a
/// tileset.json.
void check_not_a_part(const std::filesystem::path& out, const std::filesystem::path& input);

}  // namespace ewa::cli
