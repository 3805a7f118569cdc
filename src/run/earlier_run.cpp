// SPDX-License-Identifier: Apache-2.0
#include "run/earlier_run.h"

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "core/folders.h"
#include "core/json.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "io/datasets/dataset_folders.h"
#include "report/summary.h"
#include "run/run_files.h"
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
std::optional<EarlierRun> from_checkpoint(const fs::path& folder) try {
    const Checkpoint head = read_checkpoint_head(folder / "checkpoint.ewa");
    const Json settings = core::parse_json<Json>(head.settings, "settings");
    const Json options = settings.is_object() ? settings.value("options", Json()) : Json();
    return EarlierRun{
        uint64_t(head.state.report.step), report::whole_number(options, "steps", INT32_MAX), {}};
} catch (const InputError&) {
    return std::nullopt;
}

std::optional<EarlierRun> from_summary(const fs::path& folder) try {
    const Json summary = core::read_json_file<Json>(folder / "summary.json");
    EarlierRun run;
    run.step = run.steps = report::whole_number(summary, "steps", INT32_MAX);
    const Json interrupted = summary.value("interrupted", Json());
    if (interrupted.is_boolean() && interrupted.get<bool>()) ++run.steps;
    if (summary.contains("test_psnr") && summary["test_psnr"].is_number())
        run.psnr = summary["test_psnr"].get<double>();
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
    if (options.resume && core::is_file(folder / "checkpoint.ewa")) return;
    io::check_output_folder("-o", folder);
    std::error_code missing;
    for (const fs::path& photos : {options.scene, options.scene / "images"})
        if (!options.scene.empty() && fs::equivalent(folder, photos, missing))
            throw InputError("-o " + core::one_line(folder.string()) +
                             " holds the photos, where no outputs belong; name another folder");
}

}  // namespace

void check_free(const fs::path& folder, const RunOptions& options) {
    check_no_dataset(folder, options);
    if (options.force) return;
    const auto has = [&](const char* file) { return core::is_file(folder / file); };
    const std::string where = core::one_line(folder.string()) + ": ";
    if (has("checkpoint.ewa")) {
        if (options.resume) return;
        std::optional<EarlierRun> run = from_checkpoint(folder);
        if (!run) throw InputError(where + "holds a checkpoint.ewa that cannot be read; " + kReplace);
        if (const auto summary = from_summary(folder); summary && summary->step == run->step)
            run->psnr = summary->psnr;
        throw InputError(where + described(*run));
    }
    if (!has("splats.ply") && !has("summary.json") && kept_splats(folder).empty()) return;
    // Splats are saved just before the checkpoint. A kill between the two leaves no summary.
    if (options.resume && has("metrics.jsonl") && !has("summary.json")) return;
    const auto run = from_summary(folder);
    throw InputError(where + (run ? fmt::format("holds a run of {} steps", run->step) : "holds splats.ply") +
                     " without the checkpoint.ewa from which --resume continues; " + kReplace);
}

}  // namespace ewa::train
