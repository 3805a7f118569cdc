// SPDX-License-Identifier: Apache-2.0
// transforms.json in the dialects of instant-ngp, nerfstudio and Blender's synthetic scenes (NeRF).
#pragma once
#include <filesystem>

#include "io/datasets/posed_images.h"

namespace ewa::io {

/// Intrinsics stand at the top or in each frame: fl_x fl_y cx cy w h k1 k2 k3 p1 p2, or camera_angle_x and _y
/// (radians). camera_model OPENCV_FISHEYE or is_fisheye: OpenCV's fisheye with k1 to k4; FULL_OPENCV: k1 to
/// k6. Missing: fl_y as fl_x, the centre in the middle, the size from the picture's header. transform_matrix
/// is camera to world with OpenGL's camera axes (y up, z back); the axes of the camera are turned to
/// OpenCV's, the world stays the file's (applied_transform says what nerfstudio did to it before it wrote the
/// file, and its points have had the same). A rotation with a uniform factor or a little noise is made
/// orthonormal. ply_file_path gives the points. A file_path without extension gets .png, .jpg or .jpeg,
/// whichever is there; it is relative to the json's folder. "view_dependent": false at the top says that no
/// colour depends on where it is seen from (`ewa dataset` writes it where every material is diffuse). `split`
/// becomes each image's. with_points false: points are not read. Throws InputError that names the file and
/// the byte or the frame.
PosedImages read_transforms(const std::filesystem::path& path, int split, bool with_points);

}  // namespace ewa::io
