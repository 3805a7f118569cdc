// SPDX-License-Identifier: Apache-2.0
// 3D Tiles 1.1 (OGC 22-025r4): a tileset.json beside a folder with a .glb for each tile, for globes such as CesiumJS. The folder is tiles/,
// or the first free one of tiles-2/, tiles-3/ and so on, so that an earlier tileset stays whole until the new tileset.json is in its place.
//
// A tree divides the scene in boxes, and each tile has the splats in its box: the tiles without children those of the scene, and their
// parents those of a level with half as many, and so on. A viewer replaces a tile by its children where its geometricError (world
// units) covers too many pixels. The box is in the frame of 3D Tiles, where z is up. Each tile has its own origin, by its transform: an SPZ
// has positions of 24 bits.
//
// The tiles have Cesium's older profile of KHR_gaussian_splatting_compression_spz_2, without "kernel" and "colorSpace": CesiumJS takes the
// values of an SPZ as they are stored, which gltf_splats.cpp does for this profile too. So x of a PLY points east, z north and y down.
#pragma once
#include <filesystem>
#include <glm/mat4x4.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "ewa/gaussians.h"
#include "ewa/splat_scene.h"
#include "io/splats/place.h"

namespace ewa::io {

inline constexpr const char* kTilesetName = "tileset.json";

/// From an INRIA PLY's frame at the place to earth-centred, earth-fixed coordinates (EPSG 4978), metres: x east, z north, y down.
glm::dmat4 earth_of_place(const Place& place);

/// Writes the tiles, then the tileset.json. Removes the tiles of the one that it replaced, and those that killed processes left beside it.
/// Returns a line for each thing that the format does not store. Throws InputError for a scene without splats, RunError.
/// The same scene gives the same bytes. Splats must be drawable, with opacities of 3DGS's kernel. options.levels: 0 for tiles of at most
/// 100,000 splats; else the most levels whose tiles have 1,000 splats. The scene is on the globe where options.earth says, else where its
/// comments do.
std::vector<std::string> write_tileset(const std::filesystem::path& path, Gaussians gaussians,
                                       const SaveOptions& options);

/// Whether this is the name of a folder that write_tileset makes.
bool names_tile_folder(std::string_view name);

/// The tiles of an existing tileset.json that are in or below its folder. Empty if it cannot be read.
std::vector<std::filesystem::path> tile_files(const std::filesystem::path& tileset);

}  // namespace ewa::io
