// SPDX-License-Identifier: Apache-2.0
// The folder of a training run in the place of a splat file or of a dataset.
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

/// Gives --kernel, --background, --downscale, --max-width, --masks, --lens and --test-every the run's values, where `app` has the option
/// and the command line does not. other: a dataset in place of the run's; its images become as wide as those that the run was trained on,
/// where they are wider. Empty: none. Throws InputError for a value that the option refuses.
void use_options_of(const folders::Run& run, CLI::App& app, const std::filesystem::path& other = {});

/// The cameras of the run's dataset as it was trained, refined ones if it has them. Throws InputError.
Dataset cameras_of_run(const folders::Run& run);

/// Which appearance images get.
struct AppearanceArguments {
    std::string file = "auto";  // or "none", or "auto": the file beside the splats of a run, if it is there
    std::string of;  // the training image whose appearance all others get; empty: see NewViewAppearance
    std::optional<folders::Run> run = {};  // of the splats, where `of` is searched; empty: none
};

/// --exposures and --appearance-of of ewa eval and ewa render.
void add_appearance_options(CLI::App& app, AppearanceArguments& arguments);

/// The appearance of each of these frames. Those that the file does not have, as those that were held out, get that of a new
/// view.
/// run: that of the splats, with its own dataset; empty: none.
/// Empty where there are none. Throws InputError, also if the file has none of the dataset's frames.
std::vector<Appearance> appearances_of(const AppearanceArguments& arguments,
                                       const std::optional<folders::Run>& run, const Dataset& dataset,
                                       const std::vector<int>& frames);

/// The appearance of views that no image has. run: as above. dataset: with the run's cameras; null: unknown. Throws InputError.
NewViewAppearance appearance_of_new_views(const AppearanceArguments& arguments,
                                          const std::optional<folders::Run>& run, const Dataset* dataset);

/// Replaces a run's folder among SPLATS and DATASET. Without DATASET, it is that of the run, also of a run that SPLATS
/// is a file of. The run's options are used as in use_options_of, unless both arguments are files. Throws InputError,
/// also if nothing names the dataset. Returns the run that SPLATS is of, if its dataset is used.
std::optional<folders::Run> resolve_views(CLI::App& app, ViewArguments& arguments);

}  // namespace ewa::cli
