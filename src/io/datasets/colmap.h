// SPDX-License-Identifier: Apache-2.0
// COLMAP's sparse model: cameras, images, points3D as .bin or .txt (colmap.github.io/format.html).
#pragma once
#include <filesystem>
#include <optional>

#include "io/datasets/posed_images.h"

namespace ewa::io {

/// The folder of `root` that holds a model (cameras and images of one kind): sparse/0, sparse, or root
/// itself.
std::optional<std::filesystem::path> find_colmap_model(const std::filesystem::path& root);

/// The model in a folder, its pictures named relative to `images`. .bin is preferred, as COLMAP does. A
/// missing points3D file gives no points. World and cameras are as in the file (COLMAP's axes are OpenCV's).
/// Taken is every lens model of COLMAP but EQUIRECTANGULAR, which is no perspective picture. Throws
/// InputError that names the file and the byte (.bin) or line (.txt).
PosedImages read_colmap(const std::filesystem::path& model, const std::filesystem::path& images);

}  // namespace ewa::io
