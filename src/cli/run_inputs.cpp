// SPDX-License-Identifier: Apache-2.0
#include "cli/run_inputs.h"

#include <CLI/CLI.hpp>

#include "cli/config.h"
#include "core/folders.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/datasets/image_records.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

bool holds_dataset(const fs::path& folder) {
    for (const char* name : {"transforms.json", "transforms_train.json", "transforms_test.json"})
        if (core::is_file(folder / name)) return true;
    return io::find_colmap_model(folder).has_value();
}

}  // namespace

std::optional<live::Run> find_run(const fs::path& path) {
    if (!core::is_folder(path) || holds_dataset(path)) return std::nullopt;
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
    for (const char* name : {"kernel", "background", "downscale", "masks", "test-every"}) {
        const auto value = run.config.find(name);
        if (value == run.config.end() || *value == "random") continue;  // random: evaluated over black
        apply_config_value(app, name, *value, config);
    }
}

void resolve_views(CLI::App& app, ViewArguments& arguments) {
    SplatInput input = splat_input(arguments.splats);
    arguments.splats = input.file;
    if (!arguments.dataset.empty()) {
        arguments.dataset = dataset_input(arguments.dataset);
    } else {
        if (!input.run) input.run = live::run_of_splats(arguments.splats);
        if (!input.run)
            throw InputError("DATASET is required: " + core::one_line(arguments.splats.string()) +
                             " is not of a training run, whose config.json would name it");
        arguments.dataset = dataset_of(*input.run);
    }
    if (input.run) use_options_of(*input.run, app);
}

}  // namespace ewa::cli
