// SPDX-License-Identifier: Apache-2.0
// The files of ewa convert: a scene may consist of more files than the one that the command line names.
#pragma once
#include <cstdint>
#include <filesystem>
#include <vector>

namespace ewa::cli {

/// The files that hold the values of an existing file, such as those of a .gltf or meta.json; empty for formats of one file.
std::vector<std::filesystem::path> values_of(const std::filesystem::path& path);

/// The further files that an output consists of. unbundled: the output is a web page whose scene is in files beside it.
std::vector<std::filesystem::path> parts_of(const std::filesystem::path& out, bool unbundled);

/// The size of the files on disk. Hard links to one file count once.
uint64_t bytes_of(const std::vector<std::filesystem::path>& files);

/// Throws InputError if an input is one of the parts that `out` writes: a chunk in a folder N_M of a lod-meta.json, or a tile of a
/// tileset.json.
void check_not_a_part(const std::filesystem::path& out, const std::filesystem::path& input);

}  // namespace ewa::cli
