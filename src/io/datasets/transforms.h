// SPDX-License-Identifier: Apache-2.0
// transforms.json in the dialects of instant-ngp, nerfstudio and Blender's synthetic scenes (NeRF).
//
// A key of a frame wins over the same key at the top of the file.
//   fl_x fl_y cx cy w h            px; defaults: fl_y is fl_x, (cx, cy) the centre, w h the image's size
//   camera_angle_x camera_angle_y  angles of view in radians, in place of fl_x and fl_y
//   k1 k2 k3 p1 p2                 OpenCV's distortion
//   camera_model, is_fisheye       OPENCV_FISHEYE: fisheye with k1 to k4; FULL_OPENCV: k1 to k6
//   transform_matrix               camera to world; camera axes are OpenGL's (x right, y up, z back)
//   file_path                      relative to the file's folder; may lack .png, .jpg or .jpeg
//   mask_path                      the image's mask
//   ply_file_path                  points, at the top of the file
//   view_dependent                 at the top: false if no colour depends on the direction of view
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "io/datasets/image_records.h"

namespace ewa::io {

/// Reads the file. Cameras get OpenCV's axes; the world frame stays the file's. nerfstudio's
/// applied_transform is ignored, because it already applies to cameras and points alike. A rotation with a
/// uniform factor or a little noise becomes orthonormal. `split` becomes each image's. with_points false
/// skips the points. Throws InputError that names the file and the byte or frame.
ImageRecords read_transforms(const std::filesystem::path& path, int split, bool with_points);

struct TransformsFrame {
    std::string image, depth;  // relative to the file's folder, with / between the parts
    Camera camera;
};

struct TransformsFile {
    std::vector<TransformsFrame> frames;
    std::string points;                                        // relative; empty: none
    bool color_depends_on_view = true;                         // false is written as "view_dependent": false
    std::vector<std::pair<std::string, std::string>> remarks;  // further keys and texts at the top
};

/// Writes the intrinsics into each frame. The world frame stays. Throws RunError.
void write_transforms(const std::filesystem::path& path, const TransformsFile& file);

}  // namespace ewa::io
