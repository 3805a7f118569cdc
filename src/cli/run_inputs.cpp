// SPDX-License-Identifier: Apache-2.0
#include "cli/run_inputs.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "cli/config.h"
#include "core/folders.h"
#include "core/messages.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/datasets/dataset_folders.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

}  // namespace

std::optional<live::Run> find_run(const fs::path& path) {
    if (!core::is_folder(path) || io::is_dataset_folder(path)) return std::nullopt;
    return live::find_run(path);
}

SplatInput splat_input(const fs::path& path) {
    if (!core::is_folder(path)) return {path, {}};
    const std::string name = core::one_line(path.string());
    std::optional<live::Run> run = live::find_run(path);
    if (!run)
        throw InputError(name +
                         ": a folder without splats; expected a splat file, or the folder of a training run "
                         "with splats.ply in it");
    if (run->splats.empty())
        throw InputError(
            name +
            ": this training run has no splats.ply yet; ewa train writes it at the end, or every N "
            "steps with --save-every N");
    const fs::path file = run->splats;
    return {file, std::move(run)};
}

bool names_run_with_splats(const fs::path& path) {
    if (!core::is_folder(path)) return false;
    const std::optional<live::Run> run = live::find_run(path);
    return run && !run->splats.empty();
}

fs::path dataset_of(const live::Run& run) {
    if (!run.dataset.empty()) return run.dataset;
    const std::string config = core::one_line((run.folder / "config.json").string());
    if (run.named_dataset.empty()) throw InputError(config + ": names no dataset; name the dataset itself");
    throw InputError(
        config + ": the dataset " + core::one_line(run.named_dataset) +
        " was not found; looked in the current folder and in each folder above the run; name the "
        "dataset itself");
}

fs::path dataset_input(const fs::path& path) {
    const std::optional<live::Run> run = find_run(path);
    return run ? dataset_of(*run) : path;
}

void use_options_of(const live::Run& run, CLI::App& app) {
    const fs::path config = run.folder / "config.json";
    for (const char* name :
         {"points", "nearest", "kernel", "background", "downscale", "max-width", "masks", "test-every"}) {
        const auto value = run.config.find(name);
        if (value == run.config.end() || *value == false) continue;
        if (*value == "random") continue;  // evaluated over black
        if (name == std::string_view("nearest") && app.count("--points") == 0) continue;
        apply_config_value(app, name, *value, config);
    }
}

fs::path refined_cameras_of(const live::Run& run) {
    fs::path file = run.refined_cameras();
    if (file.empty() && run.flag("refine-poses"))
        core::warn(core::one_line(run.folder.string()) +
                   ": cameras.json is missing; the dataset's cameras are used, which --refine-poses moved");
    return file;
}

void add_exposures_option(CLI::App& app, std::string& exposures) {
    app.add_option(
           "--exposures", exposures,
           "Exposures of training images, as ewa train --exposure writes them. auto: exposures.json of the "
           "run SPLATS, with its own dataset")
        ->type_name("auto|none|FILE")
        ->capture_default_str();
}

std::vector<Exposure> exposures_of(const std::string& which, const std::optional<live::Run>& run,
                                   const Dataset& dataset, const std::vector<int>& frames) {
    fs::path file = which;
    if (which == "auto") {
        if (!run || !core::is_file(run->folder / "exposures.json")) return {};
        file = run->folder / "exposures.json";
    }
    if (which == "none") return {};
    const auto known = load_exposures(file);
    const auto has_exposure = [&](const Frame& frame) { return known.contains(frame.name); };
    if (which != "auto" && std::ranges::none_of(dataset.frames, has_exposure))
        throw InputError(core::one_line(file.string()) + ": has no exposure of an image of " +
                         core::one_line(dataset.root.string()) + "; --exposures none uses none");
    std::vector<Exposure> exposures;
    for (const int index : frames) {
        const auto found = known.find(dataset.frames[size_t(index)].name);
        exposures.push_back(found == known.end() ? kIdentityExposure : found->second);
    }
    return exposures;
}

std::optional<live::Run> resolve_views(CLI::App& app, ViewArguments& arguments) {
    SplatInput input = splat_input(arguments.splats);
    arguments.splats = input.file;
    const bool own_dataset = arguments.dataset.empty();
    if (!arguments.dataset.empty()) {
        arguments.dataset = dataset_input(arguments.dataset);
    } else {
        if (!input.run) input.run = live::run_of_splats(arguments.splats);
        if (!input.run)
            throw InputError("DATASET is required: " + core::one_line(arguments.splats.string()) +
                             " is not of a training run, whose config.json would name it");
        arguments.dataset = dataset_of(*input.run);
    }
    if (!input.run) return std::nullopt;
    use_options_of(*input.run, app);
    std::error_code none;
    if (!own_dataset && !fs::equivalent(arguments.dataset, input.run->dataset, none)) return std::nullopt;
    const std::string frames = input.run->text("frames");
    if (own_dataset && !frames.empty()) arguments.run_frames = frames;
    arguments.refined_cameras = refined_cameras_of(*input.run);
    return std::move(input.run);
}

}  // namespace ewa::cli
