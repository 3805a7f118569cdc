// SPDX-License-Identifier: Apache-2.0
// Splat scenes on disk.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "ewa/splat_scene.h"

namespace ewa {

/// The format's name in messages, e.g. "SPZ".
std::string_view name_of(SplatFormat format);

/// Programs that open the format, for people: "SuperSplat, Spark".
std::string_view readers_of(SplatFormat format);

/// The format of an extension, in upper or lower case: .ply .compressed.ply .splat .ksplat .spz .glb .gltf
/// .sog .usda .usdz .html, or of the names meta.json, lod-meta.json and tileset.json. Throws InputError for any other.
SplatFormat format_of_name(const std::filesystem::path& path);

/// The format for a file to write. Throws as format_of_name does, and for .ksplat, which ewa only reads.
SplatFormat format_to_write(const std::filesystem::path& path);

/// The format of a file by its first bytes, or by its extension if the bytes are of no known kind, as for .splat. Throws InputError
/// if neither is of a format, or the file cannot be read.
SplatFormat format_of_file(const std::filesystem::path& path);

/// Reads any of the formats but .usda, .usdz, .html and tileset.json, which ewa only writes. The peak memory is at most twice the
/// larger of the file and the scene. A file is refused if it claims more than 4 times its size and 40 MiB, or 32 times for SPZ and
/// SOG, which are compressed. Values may be infinite or NaN if the format can store that. Throws InputError that names the file and
/// the byte or property.
SplatScene read_splats(const std::filesystem::path& path);

/// Reads a level of a lod-meta.json; read_splats reads level 0. Throws InputError as read_splats does, and for a level that the
/// file lacks.
SplatScene read_splat_level(const std::filesystem::path& path, size_t level);

/// The number of splats of each level of a lod-meta.json, the finest first. Throws InputError as read_splats does.
std::vector<size_t> level_counts(const std::filesystem::path& path);

/// Reads the splats alone. Skipped contents are warnings for the log handler (ewa/log.h). Throws as read_splats does.
Gaussians load_splats(const std::filesystem::path& path);

/// Writes the format of the extension to a temporary file and renames it. So the path never holds half a file. All formats but .ply
/// skip the splats that are not drawable. Returns one line for each thing that the format cannot store: what is dropped, and the
/// number of bits of quantised values. Throws RunError (disk). Throws InputError for an unknown extension, arrays of a wrong
/// length, or values out of the format's range. The values of a .gltf or a meta.json go to new files beside it; the files that a
/// replaced .gltf or meta.json named are removed.
std::vector<std::string> save_splats(const std::filesystem::path& path, const Gaussians& gaussians,
                                     const SaveOptions& options);

/// The same for a scene that the caller moves into the call. Then a lod-meta.json, a tileset.json and an .html need no memory for a
/// copy.
std::vector<std::string> save_splats(const std::filesystem::path& path, Gaussians&& gaussians,
                                     const SaveOptions& options);

/// Writes a lod-meta.json and its chunks, in folders beside it: the scene as level 0, and further levels that decimate_splats halves
/// in place. So it takes no memory for a copy. Returns and throws as save_splats does.
std::vector<std::string> save_levels(const std::filesystem::path& path, Gaussians gaussians,
                                     const SaveOptions& options);

/// The bytes of the .sog that save_splats would write. Adds a line to `remarks` for each thing that it does not store.
/// `path` is what errors name. Throws InputError for arrays of a wrong length, and for more splats than a WebP image has pixels.
std::string sog_bytes(const std::filesystem::path& path, const Gaussians& gaussians,
                      const SaveOptions& options, std::vector<std::string>& remarks);

/// The same as save_splats with default options. Returned lines become warnings for the log handler (ewa/log.h). `comments` are
/// PLY comments, one line each.
void save_splats(const std::filesystem::path& path, const Gaussians& gaussians,
                 const std::vector<std::string>& comments = {});

}  // namespace ewa
