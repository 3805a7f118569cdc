// SPDX-License-Identifier: Apache-2.0
// ewa convert to 3D Tiles: a tileset.json for globes.
#pragma once
#include <filesystem>
#include <glm/mat4x4.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ewa/splat_scene.h"

namespace ewa::cli {

/// Whether the path names a tileset.json.
bool names_tileset(const std::filesystem::path& path);

/// The transform from the scene's world to the earth's that --geo names: LATITUDE,LONGITUDE,HEIGHT[,HEADING] or ecef. Empty for empty text.
/// Throws InputError.
std::optional<glm::dmat4> parse_geo(const std::string& text);

/// Writes the tileset.json and its tiles. Returns what it cannot store.
std::vector<std::string> write_tiles(const std::filesystem::path& path, Gaussians gaussians,
                                     const SaveOptions& options, const std::optional<glm::dmat4>& earth);

}  // namespace ewa::cli
