// SPDX-License-Identifier: Apache-2.0
// cameras.json of a run with --refine-poses: the views of view_list.h, with further keys:
//   "split": "train", "test" or "other"; "aligned": whether a test camera was aligned to its image;
//   "degrees", "moved" (world units), "percent_of_extent", "focal_factor": how far the camera is from the dataset's.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "ewa/camera_motion.h"
#include "ewa/dataset.h"

namespace ewa::io {

struct RefinedCamera {
    std::string name;  // Frame::name
    std::string split;
    Camera camera;
    CameraDistance moved;
    bool aligned = false;
};

/// extent: of the scene, world units. Throws RunError.
void write_refined_cameras(const std::filesystem::path& path, const std::vector<RefinedCamera>& cameras,
                           double extent);

struct RefinedUse {
    bool used = false;
    bool aligned = false;  // the cameras of test images were aligned to these images
};

/// Replaces the camera of each frame that the file names, at the frame's own resolution. Other frames keep their cameras.
/// Throws InputError, also if the file names none of the frames.
RefinedUse use_refined_cameras(Dataset& dataset, const std::filesystem::path& path);

}  // namespace ewa::io
