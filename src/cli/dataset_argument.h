// SPDX-License-Identifier: Apache-2.0
// The DATASET argument of commands: what load_dataset reads, or a glTF file of meshes.
#pragma once
#include <memory>
#include <optional>

#include "core/folders.h"
#include "ewa/dataset.h"
#include "ewa/device.h"
#include "ewa/synthetic_dataset.h"

namespace ewa::cli {

/// Whether the path names a glTF file of meshes: by its extension, else by its content.
bool names_mesh_scene(const std::filesystem::path& path);

/// The cameras of a dataset, whose images may be missing. If only some are, their frames are skipped as in
/// training, so that the same frames are held out; Dataset::missing_images counts them. Of a mesh scene: the
/// views that `ewa train` renders.
Dataset load_cameras_as_trained(const std::filesystem::path& path, int downscale);

/// Throws InputError, as select_frames does, if a mesh scene has none of these frames, before it is rendered.
/// Other datasets are checked once load_with_images has read them.
void check_frames(const std::filesystem::path& path, const std::string& which, int test_every);

/// A dataset with its images.
struct LoadedDataset {
    Dataset dataset;
    std::unique_ptr<core::TemporaryFolder> folder;  // the temporary folder of the images, or null
};

/// Renders a mesh scene into a dataset, with progress, and prints its notes. SyntheticDataset::interrupted:
/// Ctrl-C ended it. Throws InputError, RunError.
SyntheticDataset render_with_progress(const DeviceOptions& device, const std::filesystem::path& scene,
                                      const std::filesystem::path& folder, const SyntheticOptions& options,
                                      bool quiet);

/// Loads a dataset. Of a mesh scene: the images that `ewa train` left in `dataset` beside the splats, if they
/// show this scene, else renders it into a temporary folder. Nothing if Ctrl-C ended the rendering.
std::optional<LoadedDataset> load_with_images(const std::filesystem::path& path,
                                              const std::filesystem::path& splats,
                                              const DatasetOptions& options, const DeviceOptions& device);

}  // namespace ewa::cli
