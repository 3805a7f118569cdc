// SPDX-License-Identifier: Apache-2.0
// DATASET as commands take it: a folder or file as load_dataset's, or a glTF of meshes.
#pragma once
#include <memory>
#include <optional>

#include "core/temporary_folder.h"
#include "ewa/dataset.h"
#include "ewa/device.h"

namespace ewa::cli {

/// Whether this is a glTF of meshes: by its extension, whatever the file holds, else by what it holds.
bool names_mesh_scene(const std::filesystem::path& path);

/// The cameras of a dataset whose photographs need not be there. Where some are, frames without one are left
/// out, as training leaves them out: otherwise they would shift which frames are held out.
/// Dataset::missing_images counts them. Of a mesh scene the views that `ewa train` photographs.
Dataset load_cameras_as_trained(const std::filesystem::path& path, int downscale);

/// Throws InputError, as select_frames does, where a mesh scene has none of these frames: said before it is
/// photographed. Of any other dataset load_photographed comes as soon.
void check_frames(const std::filesystem::path& path, const std::string& which, int test_every);

/// A dataset with its photographs.
struct Photographed {
    Dataset dataset;
    std::unique_ptr<core::TemporaryFolder> folder;  // that they are in for the time being, or none
};

/// Of a mesh scene: the photographs that `ewa train` left in `dataset` beside the splats, where they are of
/// this scene; else taken now, with progress. Nothing where Ctrl-C ended that.
std::optional<Photographed> load_photographed(const std::filesystem::path& path,
                                              const std::filesystem::path& splats,
                                              const DatasetOptions& options, const DeviceOptions& device);

}  // namespace ewa::cli
