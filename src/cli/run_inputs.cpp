// SPDX-License-Identifier: Apache-2.0
#include "cli/run_inputs.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "cli/config.h"
#include "core/folders.h"
#include "core/messages.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "folders/run_folder.h"
#include "scene/names.h"

namespace ewa::cli {
namespace fs = std::filesystem;

namespace {

/// px of the widest image that the run was trained on; 0 where its dataset is not found.
int trained_width(const folders::Run& run, int downscale) try {
    int width = 0;
    for (const Frame& frame : load_cameras_as_trained(dataset_of(run)).frames)
        width = std::max(width, std::max(frame.source.width, frame.camera.width) / downscale);
    return width;
} catch (const InputError&) {
    return 0;
}

}  // namespace

void use_options_of(const folders::Run& run, CLI::App& app, const fs::path& other) {
    const fs::path config = run.folder / folders::kConfigFile;
    std::error_code none;
    const bool elsewhere = !other.empty() && !fs::equivalent(dataset_input(other), run.dataset, none);
    for (const char* name : {"points", "nearest", "integrator", "kernel", "background", "loss", "downscale",
                             "max-width", "masks", "lens", "test-every"}) {
        const auto value = run.config.find(name);
        if (value == run.config.end() || *value == false) continue;
        if (*value == "random") continue;  // evaluated over black
        if (*value == "sky" && std::string_view(name) == "background") {
            if (!core::is_file(run.folder / folders::kSkyFile))
                core::warn(core::one_line(run.folder.string()) +
                           ": sky.json is missing; the splats are drawn over black");
            continue;  // DrawArguments::load finds it
        }
        // A factor says nothing of the sizes of other images.
        if (name == std::string_view("downscale") && elsewhere && value->is_number_integer() &&
            app.count("--downscale") + app.count("--max-width") == 0)
            if (const int width = trained_width(run, std::max(1, value->get<int>())); width > 0) {
                apply_config_value(app, "max-width", width, config);
                continue;
            }
        const CLI::Option* const points = app.get_option_no_throw("--points");
        if (name == std::string_view("nearest") && (!points || points->count() == 0)) continue;
        apply_config_value(app, name, *value, config);
    }
}

void add_appearance_options(CLI::App& app, AppearanceArguments& arguments) {
    options::add(app, "exposures", arguments.file);
    options::add(app, "appearance-of", arguments.of);
}

namespace {

/// Empty: none.
fs::path appearance_file(const std::string& which, const std::optional<folders::Run>& run) {
    if (which != "auto") return which == "none" ? fs::path() : fs::path(which);
    if (!run) return {};
    for (const char* name : {folders::kAppearanceFile, folders::kOldExposuresFile})
        if (core::is_file(run->folder / name)) return run->folder / name;
    return {};
}

}  // namespace

namespace {

struct KnownAppearances {
    fs::path file;
    std::map<std::string, Appearance> images = {};
    NewViewAppearance others = {};  // of images that are not there, or of all
};

/// The centres of the images' cameras; empty unless the dataset has all of them.
std::vector<glm::dvec3> centers_of(const std::vector<std::string>& names, const Dataset& dataset) {
    std::map<std::string_view, glm::dvec3> known;
    for (const Frame& frame : dataset.frames) known.emplace(frame.name, frame.camera.position());
    std::vector<glm::dvec3> centers;
    for (const std::string& name : names)
        if (const auto found = known.find(name); found != known.end()) centers.push_back(found->second);
    if (centers.size() != names.size()) centers.clear();
    return centers;
}

KnownAppearances known_appearances(const AppearanceArguments& arguments,
                                   const std::optional<folders::Run>& run, const Dataset* dataset) {
    KnownAppearances known{
        appearance_file(arguments.file, run || arguments.of.empty() ? run : arguments.run)};
    if (known.file.empty() && !arguments.of.empty())
        throw InputError("--appearance-of: there is no appearance.json; --exposures FILE names one");
    if (known.file.empty()) return known;
    known.images = load_appearances(known.file);
    std::vector<Appearance> all;
    std::vector<std::string> names;
    for (const auto& [name, appearance] : known.images) {
        all.push_back(appearance);
        names.push_back(name);
    }
    if (arguments.of.empty()) {
        known.others = NewViewAppearance(std::move(all),
                                         dataset ? centers_of(names, *dataset) : std::vector<glm::dvec3>());
        return known;
    }
    const int named = scene::index_of_name(names, arguments.of);
    if (named < 0)
        throw InputError("--appearance-of " + core::one_line(arguments.of) + ": no image of " +
                         core::one_line(known.file.string()) + core::did_you_mean(arguments.of, names));
    known.others = NewViewAppearance({all[size_t(named)]});
    return known;
}

}  // namespace

std::vector<Appearance> appearances_of(const AppearanceArguments& arguments,
                                       const std::optional<folders::Run>& run, const Dataset& dataset,
                                       const std::vector<int>& frames) {
    const KnownAppearances known = known_appearances(arguments, run, &dataset);
    const auto has_appearance = [&](const Frame& frame) { return known.images.contains(frame.name); };
    if (!known.file.empty() && arguments.file != "auto" && arguments.of.empty() &&
        std::ranges::none_of(dataset.frames, has_appearance))
        throw InputError(core::one_line(known.file.string()) + ": has no exposure of an image of " +
                         core::one_line(dataset.root.string()) + "; --exposures none uses none");
    std::vector<Appearance> appearances;
    for (const int index : frames) {
        const Frame& frame = dataset.frames[size_t(index)];
        const auto found = known.images.find(frame.name);
        if (found != known.images.end() && arguments.of.empty())
            appearances.push_back(found->second);
        else if (auto of_new_view = known.others.at(frame.camera.position()))
            appearances.push_back(std::move(*of_new_view));
    }
    return appearances;
}

NewViewAppearance appearance_of_new_views(const AppearanceArguments& arguments,
                                          const std::optional<folders::Run>& run, const Dataset* dataset) {
    return known_appearances(arguments, run, dataset).others;
}

std::optional<folders::Run> resolve_views(CLI::App& app, ViewArguments& arguments) {
    SplatInput input = splat_input(arguments.splats);
    arguments.splats = input.file;
    const bool own_dataset = arguments.dataset.empty();
    if (!arguments.dataset.empty()) {
        arguments.dataset = dataset_input(arguments.dataset);
    } else {
        if (!input.run) input.run = folders::run_of_splats(arguments.splats);
        if (!input.run)
            throw InputError("DATASET is required: " + core::one_line(arguments.splats.string()) +
                             " is not of a training run, whose config.json would name it");
        arguments.dataset = dataset_of(*input.run);
    }
    if (!input.run) return std::nullopt;
    use_options_of(*input.run, app, own_dataset ? fs::path() : arguments.dataset);
    std::error_code none;
    if (!own_dataset && !fs::equivalent(arguments.dataset, input.run->dataset, none)) return std::nullopt;
    const std::string frames = input.run->text("frames");
    if (own_dataset && !frames.empty()) arguments.run_frames = frames;
    arguments.refined_cameras = refined_cameras_of(*input.run);
    return std::move(input.run);
}

Dataset cameras_of_run(const folders::Run& run) {
    Dataset dataset = load_cameras_as_trained(dataset_of(run));
    const std::filesystem::path refined = refined_cameras_of(run);
    if (!refined.empty()) io::use_refined_cameras(dataset, refined);
    return dataset;
}

}  // namespace ewa::cli
