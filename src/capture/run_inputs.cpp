// SPDX-License-Identifier: Apache-2.0
#include "capture/run_inputs.h"

#include "capture/what_is.h"
#include "core/folders.h"
#include "core/messages.h"
#include "core/text.h"
#include "core/words.h"
#include "ewa/error.h"
#include "scene/looks.h"

namespace ewa::capture {
namespace fs = std::filesystem;

std::optional<folders::Run> run_named(const fs::path& path) {
    return core::is_folder(path) && what_is(path) == What::run ? folders::find_run(path) : std::nullopt;
}

SplatInput splat_input(const fs::path& path) {
    if (!core::is_folder(path)) return {path, {}};
    const std::string name = core::one_line(path.string());
    std::optional<folders::Run> run = folders::find_run(path);
    if (!run) {
        const std::string runs = folders::runs_in(path);
        throw InputError(name +
                         ": a folder without splats; expected a splat file, or the folder of a training run "
                         "with splats.ply in it" +
                         (runs.empty() ? "" : ", such as " + runs));
    }
    if (run->splats.empty())
        throw InputError(
            name +
            ": this training run has no splats.ply yet; ewa train writes it at the end, or every N "
            "steps with --save-every N");
    const fs::path file = run->splats;
    return {file, std::move(run)};
}

bool names_run_with_splats(const fs::path& path) {
    const auto run = core::is_folder(path) ? folders::find_run(path) : std::nullopt;
    return run && !run->splats.empty();
}

fs::path dataset_of(const folders::Run& run) {
    if (!run.dataset.empty()) return run.dataset;
    const std::string config = core::one_line((run.folder / folders::kConfigFile).string());
    if (run.named_dataset.empty()) throw InputError(config + ": names no dataset; name the dataset itself");
    throw InputError(
        config + ": the dataset " + core::one_line(run.named_dataset) +
        " was not found; looked in the current folder and in each folder above the run; name the "
        "dataset itself");
}

fs::path dataset_input(const fs::path& path) {
    const std::optional<folders::Run> run = run_named(path);
    return run ? dataset_of(*run) : path;
}

fs::path refined_cameras_of(const folders::Run& run) {
    fs::path file = run.refined_cameras();
    if (file.empty() && run.flag("refine-poses"))
        core::warn(core::one_line(run.folder.string()) +
                   ": cameras.json is missing; the dataset's cameras are used, which --refine-poses moved");
    return file;
}

DatasetOptions dataset_options_of(const folders::Run& run) {
    DatasetOptions options;
    options.downscale = run.number("downscale", 1, 1024, options.downscale);
    options.max_width = run.number("max-width", 0, 65535, options.max_width);
    options.masks = core::find_value(scene::kMaskWords, run.text("masks")).value_or(options.masks);
    options.lens = core::find_value(scene::kLensWords, run.text("lens")).value_or(options.lens);
    return options;
}

}  // namespace ewa::capture
