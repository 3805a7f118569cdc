// SPDX-License-Identifier: Apache-2.0
// COLMAP's sparse model: cameras, images and points3D as .bin or .txt (colmap.github.io/format.html).
#pragma once
#include <filesystem>
#include <optional>

#include "io/datasets/image_records.h"

namespace ewa::io {

/// The folder below `root` that holds a model, that is cameras and images of one kind. Candidates in this
/// order: sparse/0, sparse, root itself.
std::optional<std::filesystem::path> find_colmap_model(const std::filesystem::path& root);

/// Reads the model in a folder. Image names are relative to `images`. As in COLMAP, .bin is preferred.
/// Without a points3D file there are no points. World and cameras are as in the file: COLMAP's axes are
/// OpenCV's. Every lens model of COLMAP is supported except EQUIRECTANGULAR, which is no perspective image.
/// Throws InputError that names the file and the byte (.bin) or line (.txt).
ImageRecords read_colmap(const std::filesystem::path& model, const std::filesystem::path& images);

}  // namespace ewa::io
