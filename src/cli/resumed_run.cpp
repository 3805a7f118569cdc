// SPDX-License-Identifier: Apache-2.0
#include "cli/resumed_run.h"

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/config.h"
#include "cli/run_inputs.h"
#include "core/text.h"
#include "ewa/error.h"
#include "folders/run.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

/// A run that made its dataset keeps the name of what it made it of, which need not exist any more.
void use_dataset_of(const folders::Run& run, RunOptions& options) {
    options.dataset = dataset_of(run);
    if (run.made_dataset()) options.scene = run.named_dataset;
}

bool same_folder(const fs::path& a, const fs::path& b) {
    std::error_code missing;
    return fs::equivalent(a, b, missing);
}

}  // namespace

void settle_dataset(RunOptions& options) {
    const std::optional<folders::Run> run = run_named(options.dataset);
    if (!run) return;
    if (options.output.empty()) options.output = run->folder;
    const bool own_folder = same_folder(options.output, run->folder);
    if (options.resume && !own_folder)
        throw InputError(core::one_line(
            fmt::format("{} is a run, which --resume continues in its own folder, not in -o {}; leave one of "
                        "them out",
                        run->folder.string(), options.output.string())));
    if (own_folder)
        use_dataset_of(*run, options);
    else
        options.dataset = dataset_of(*run);
}

void take_options_of_run(CLI::App& app, RunOptions& options, bool keep_steps) {
    if (!options.resume) return;
    if (options.dataset.empty() && options.output.empty())
        throw InputError("--resume needs the folder of a run: ewa train RUN --resume");
    const fs::path folder = output_folder(options);
    const std::optional<folders::Run> run =
        folders::is_run(folder) ? folders::find_run(folder) : std::nullopt;
    if (!run) {
        if (options.dataset.empty())
            throw InputError(core::one_line(folder.string()) +
                             ": there is no run to continue; name the DATASET to begin one");
        return;
    }
    if (options.dataset.empty()) use_dataset_of(*run, options);
    nlohmann::json values = run->config;
    values.erase("dataset");
    if (keep_steps) values.erase("steps");
    if (app.count("--kernel") > 0) values.erase("nearest");  // of --points
    const bool own_init = app.count("--init") == 0;
    apply_run_config(app, values, folder / folders::kConfigFile);
    if (own_init) options.init_folder = folders::base_of(folder, options.init).value_or(fs::path());
}

}  // namespace ewa::cli
