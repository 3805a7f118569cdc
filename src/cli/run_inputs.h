// SPDX-License-Identifier: Apache-2.0
// Lets commands take the folder of a training run instead of a splat file or a dataset.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/run_inputs.h"
#include "cli/arguments.h"
#include "ewa/appearance.h"

namespace ewa::cli {

using capture::dataset_input;
using capture::dataset_of;
using capture::names_run_with_splats;
using capture::refined_cameras_of;
using capture::run_named;
using capture::splat_input;
using capture::SplatInput;

/// Sets --kernel, --background, --downscale, --max-width, --masks, --lens and --test-every to the run's values. Skips options
/// that `app` lacks or the command line has. other: a dataset that replaces the run's; empty: none. Its wider images are
/// reduced to the width of the run's training images. Throws InputError for a value that the option refuses.
void use_options_of(const folders::Run& run, CLI::App& app, const std::filesystem::path& other = {});

/// The cameras that the run was trained with: the refined ones if the run has them, else those of its dataset. Throws InputError.
Dataset cameras_of_run(const folders::Run& run);

/// The options that choose the appearance (such as exposure) of each render.
struct AppearanceArguments {
    std::string file = "auto";  // or "none", or "auto": the file beside the splats of a run, if it is there
    std::string of;  // the training image whose appearance all others get; empty: see NewViewAppearance
    std::optional<folders::Run> run = {};  // of the splats, where `of` is searched; empty: none
};

/// --exposures and --appearance-of of ewa eval and ewa render.
void add_appearance_options(CLI::App& app, AppearanceArguments& arguments);

/// The appearance of each of these frames. Frames that the file lacks, such as held-out ones, get that of a new view.
/// Empty if the arguments give no appearances.
/// run: the run of the splats, if `dataset` is its own; empty: none.
/// Throws InputError, also if the file has none of the dataset's frames.
std::vector<Appearance> appearances_of(const AppearanceArguments& arguments,
                                       const std::optional<folders::Run>& run, const Dataset& dataset,
                                       const std::vector<int>& frames);

/// The appearance of new views, which no training image has. run: as in appearances_of(). dataset: has the run's cameras; null:
/// unknown. Throws InputError.
NewViewAppearance appearance_of_new_views(const AppearanceArguments& arguments,
                                          const std::optional<folders::Run>& run, const Dataset* dataset);

/// Replaces a run's folder as SPLATS or DATASET by the run's splats or dataset. Without DATASET, takes the dataset of the run
/// that SPLATS is or belongs to. Applies use_options_of(), unless both arguments are files. Throws InputError,
/// also if no dataset is known. Returns the run of SPLATS if its dataset is used.
std::optional<folders::Run> resolve_views(CLI::App& app, ViewArguments& arguments);

}  // namespace ewa::cli
