// SPDX-License-Identifier: Apache-2.0
// Resolves a path that may be the folder of a training run, to the run's splats or dataset.
#pragma once
#include <filesystem>
#include <optional>

#include "ewa/dataset.h"
#include "folders/run.h"

namespace ewa::capture {

/// The run whose folder this is. Empty for other paths, and for a folder that is also a dataset.
std::optional<folders::Run> run_named(const std::filesystem::path& path);

/// A path that names splats.
struct SplatInput {
    std::filesystem::path file;       // the path itself, or splats.ply of the run's folder
    std::optional<folders::Run> run;  // if the path is a run's folder
};
/// The splats that a path names. A path that is no folder stays as it is, since the reader of splats checks it. Throws
/// InputError for a folder that is not a run's, or whose run has no splats yet.
SplatInput splat_input(const std::filesystem::path& path);

/// Whether the path is the folder of a run that has splats.
bool names_run_with_splats(const std::filesystem::path& path);

/// The path itself, or the dataset of the run whose folder it is. A folder that holds both is a dataset. Throws
/// InputError if the run's dataset is not found.
std::filesystem::path dataset_input(const std::filesystem::path& path);

/// The dataset of a run. Throws InputError that says where it was searched.
std::filesystem::path dataset_of(const folders::Run& run);

/// cameras.json of the run. Empty if its cameras are those of the dataset. Warns if they should be refined, and the file
/// is missing.
std::filesystem::path refined_cameras_of(const folders::Run& run);

/// The options by which the run reads its images. Those that its config.json lacks have their defaults.
DatasetOptions dataset_options_of(const folders::Run& run);

}  // namespace ewa::capture
