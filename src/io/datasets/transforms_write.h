// SPDX-License-Identifier: Apache-2.0
// transforms.json as src/io/transforms.h reads it.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "ewa/camera.h"
#include "ewa/dataset.h"

namespace ewa::io {

struct TransformsFrame {
    std::string image, depth;  // relative to the file's folder, with /
    Camera camera;
};

struct TransformsFile {
    std::vector<TransformsFrame> frames;
    std::string points;                                        // relative; empty: none
    bool color_depends_on_view = true;                         // false is written as "view_dependent": false
    std::vector<std::pair<std::string, std::string>> remarks;  // further texts at the top
};

/// Intrinsics stand in each frame. transform_matrix is camera to world with OpenGL's axes; the world stays.
/// Throws RunError.
void write_transforms(const std::filesystem::path& path, const TransformsFile& file);

/// Binary PLY of x y z (float32) and red green blue (8 bits). Throws RunError.
void write_points_ply(const std::filesystem::path& path, const PointCloud& points);

}  // namespace ewa::io
