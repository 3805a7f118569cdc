// SPDX-License-Identifier: Apache-2.0
// Coloured point clouds in PLY files.
#pragma once
#include <filesystem>

#include "ewa/dataset.h"
#include "io/datasets/posed_images.h"

namespace ewa::io {

struct PlyPoints {
    PointCloud points;
    DroppedPoints dropped;
};

/// Vertices with x y z and, where there are, red green blue (integers 0..255, or floating-point 0..1);
/// without colours mid-grey. Positions in the file's own frame. Throws InputError that names the file and the
/// byte or property.
PlyPoints read_points_ply(const std::filesystem::path& path);

}  // namespace ewa::io
