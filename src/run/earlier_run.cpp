// SPDX-License-Identifier: Apache-2.0
#include "run/earlier_run.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "core/folders.h"
#include "core/json.h"
#include "core/json_field.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "folders/former_options.h"
#include "folders/run_folder.h"
#include "io/datasets/dataset_folders.h"
#include "run/option_table.h"
#include "train/checkpoint.h"

namespace ewa::train {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kReplace = "-o DIR takes another folder, --force replaces it";

/// The facts of a run that an error names.
struct EarlierRun {
    uint64_t step = 0, steps = 0;  // done, and asked for
    std::optional<double> psnr;    // dB, of held-out images at the end
};

/// Empty if the file is missing or damaged.
std::optional<EarlierRun> from_checkpoint(const folders::RunFolder& folder) try {
    const Checkpoint head = read_checkpoint_head(folder / folders::kCheckpointFile);
    const auto settings = core::JsonField::of_text(head.settings, "settings");
    return EarlierRun{
        uint64_t(head.state.report.step), settings.object("options").whole("steps", INT32_MAX), {}};
} catch (const InputError&) {
    return std::nullopt;
}

std::optional<EarlierRun> from_summary(const folders::RunFolder& folder) try {
    const auto summary = core::JsonField::of_file(folder / folders::kSummaryFile);
    EarlierRun run;
    run.step = run.steps = summary.whole("steps", INT32_MAX);
    if (summary.flag("interrupted")) ++run.steps;
    run.psnr = core::number_in(summary.value(), "test_psnr");
    return run;
} catch (const InputError&) {
    return std::nullopt;
}

/// The run and the ways out, for a folder that has a checkpoint.
std::string described(const EarlierRun& run) {
    if (run.step < run.steps)
        return fmt::format("holds an unfinished run, at step {} of {}; --resume continues it, {}", run.step,
                           run.steps, kReplace);
    return fmt::format("holds a finished run of {}{}; --resume with more --steps trains it further, {}",
                       core::counted(uint64_t(run.step), "step"),
                       run.psnr ? fmt::format(" ({:.2f} dB)", *run.psnr) : "", kReplace);
}

/// Throws InputError if the run would lie among photos. A run that is already there may continue.
void check_no_dataset(const fs::path& folder, const RunOptions& options) {
    if (options.resume && folders::RunFolder(folder).has(folders::kCheckpointFile)) return;
    io::check_output_folder("-o", folder);
    std::error_code missing;
    for (const fs::path& photos : {options.scene, options.scene / "images"})
        if (!options.scene.empty() && fs::equivalent(folder, photos, missing))
            throw InputError("-o " + core::one_line(folder.string()) +
                             " holds the photos, where no outputs belong; name another folder");
}

/// Whether the file has options of a run alone.
bool is_config(const fs::path& file) try {
    const Json config = folders::with_present_names(core::read_json_file<Json>(file));
    const auto known = [](const auto& item) {
        return item.value() == false || item.value() == "" ||
               std::ranges::any_of(run_options(),
                                   [&](const RunOption& option) { return option.name == item.key(); });
    };
    const auto items = config.items();
    return config.is_object() && std::all_of(items.begin(), items.end(), known);
} catch (const InputError&) {
    return false;
}

/// Throws InputError if a folder without a run has something with a name that a run writes or removes. Links are replaced.
void check_no_names_of_others(const folders::RunFolder& folder) {
    if (folder.is_run()) return;
    const auto refuse = [&](const fs::path& name) {
        throw InputError(core::one_line(folder.path().string()) + ": holds " + core::one_line(name.string()) +
                         ", which a run writes and no run of this folder has written; " + kReplace);
    };
    std::error_code absent;
    const auto is = [&](const char* name, fs::file_type type) {
        return fs::symlink_status(folder / name, absent).type() == type;
    };
    for (const char* name : folders::kRunFiles)
        if (is(name, fs::file_type::regular) &&
            (name != std::string_view(folders::kConfigFile) || !is_config(folder / folders::kConfigFile)))
            refuse(name);
    for (const char* name : folders::kCameraModelFiles)
        if (is(name, fs::file_type::regular)) refuse(name);
    // What a killed command left is no user's.
    const auto is_of_user = [](const fs::directory_entry& entry) {
        return !entry.path().filename().string().starts_with(".ewa-");
    };
    for (const char* name :
         {folders::kTestFolder, folders::kTrainFolder, folders::kInriaFolder, folders::kPassersByFolder})
        if (is(name, fs::file_type::directory) &&
            std::ranges::any_of(fs::directory_iterator(folder / name, absent), is_of_user))
            refuse(name);
}

}  // namespace

void check_free(const fs::path& path, const RunOptions& options) {
    check_no_dataset(path, options);
    if (options.force) return;
    const folders::RunFolder folder(path);
    const std::string where = core::one_line(path.string()) + ": ";
    const bool has_summary = folder.has(folders::kSummaryFile);
    if (folder.has(folders::kCheckpointFile)) {
        if (options.resume) return;
        std::optional<EarlierRun> run = from_checkpoint(folder);
        if (!run) throw InputError(where + "holds a checkpoint.ewa that cannot be read; " + kReplace);
        if (const auto summary = from_summary(folder); summary && summary->step == run->step)
            run->psnr = summary->psnr;
        throw InputError(where + described(*run));
    }
    if (!folder.has(folders::kSplatsFile) && !has_summary && folder.kept_splats().empty())
        return check_no_names_of_others(folder);
    // Splats are saved just before the checkpoint. A kill between the two leaves no summary.
    if (options.resume && folder.has(folders::kMetricsFile) && !has_summary) return;
    const auto run = from_summary(folder);
    throw InputError(where + (run ? fmt::format("holds a run of {} steps", run->step) : "holds splats.ply") +
                     " without the checkpoint.ewa from which --resume continues; " + kReplace);
}

}  // namespace ewa::train
