// SPDX-License-Identifier: Apache-2.0
// A file of splats and a camera, in the byte layout of memory. `ewa bench` hands it to ewa-bench, which links no reader of splat
// formats.
#pragma once
#include <filesystem>

#include "ewa/camera.h"
#include "ewa/gaussians.h"

namespace ewa::scene {

struct SceneFile {
    Gaussians gaussians;
    Camera camera;  // a pinhole at rest; width 0: none
};

/// Writes the file. Throws RunError.
void write_scene_file(const std::filesystem::path& path, const SceneFile& scene);

/// Throws InputError for a file that write_scene_file has not written whole on a machine of this byte order.
SceneFile read_scene_file(const std::filesystem::path& path);

}  // namespace ewa::scene
