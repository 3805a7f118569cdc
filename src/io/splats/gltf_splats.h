// SPDX-License-Identifier: Apache-2.0
// Names and values that the reader and the writer of splats in glTF share. gltf_splats.cpp describes the layout.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "ewa/splat_scene.h"
#include "io/gltf/document.h"
#include "io/splats/formats.h"

namespace ewa::io {

inline const std::string kSplatPrefix = kSplatExtension + ":";

inline const std::string& kSpzExtension = kSpzExtensions[0];  // which is written

/// The attribute of an SH coefficient; both count from 0.
inline std::string sh_name(int degree, int coefficient) {
    return kSplatPrefix + "SH_DEGREE_" + std::to_string(degree) + "_COEF_" + std::to_string(coefficient);
}

/// Writes the content of a tile of 3D Tiles: a .glb with an SPZ, in Cesium's older profile. Otherwise as write_gltf_splats. Adds to
/// `loss`.
void write_cesium_tile(const std::filesystem::path& path, const Gaussians& gaussians,
                       const SaveOptions& options, SpzLoss& loss);

}  // namespace ewa::io
