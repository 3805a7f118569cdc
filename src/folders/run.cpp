// SPDX-License-Identifier: Apache-2.0
#include "folders/run.h"

#include <algorithm>

#include "core/folders.h"
#include "core/json.h"
#include "core/json_field.h"
#include "core/text.h"
#include "ewa/error.h"
#include "folders/run_folder.h"

namespace ewa::folders {
namespace {

namespace fs = std::filesystem;

/// Whether the run made the dataset in its folder of these photos or this video.
bool made_of(const fs::path& dataset, const fs::path& named) try {
    const auto capture =
        core::read_json_file<nlohmann::json>(dataset / kCaptureFile, {.bytes = kMostConfigBytes});
    const std::string input = core::text_in(capture, "input");
    // The folder above may have moved since.
    const auto last = [](const fs::path& path) {
        return (path.lexically_normal() / "").parent_path().filename();
    };
    return !input.empty() && last(input) == last(named);
} catch (const InputError&) {
    return false;
}

fs::path dataset_of(const fs::path& run, const fs::path& named) {
    if (named.empty()) return {};
    const std::string extension = core::lower(named.extension().string());
    const bool mesh = extension == ".gltf" || extension == ".glb";
    if (mesh && core::is_file(run / kMadeDataset / "transforms.json")) return run / kMadeDataset;
    if (made_of(run / kMadeDataset, named)) return run / kMadeDataset;
    const std::optional<fs::path> base = base_of(run, named);
    return base ? *base / named : fs::path();
}

}  // namespace

std::optional<fs::path> base_of(const fs::path& run, const fs::path& named) {
    std::error_code error;
    if (fs::exists(named, error)) return fs::path();
    if (named.is_absolute()) return std::nullopt;
    for (fs::path folder = fs::absolute(run, error); folder.has_relative_path();
         folder = folder.parent_path())
        if (fs::exists(folder / named, error)) return folder;
    return std::nullopt;
}

bool Run::made_dataset() const {
    return dataset == folder / kMadeDataset && fs::path(named_dataset) != dataset;
}

std::string Run::text(const char* option) const {
    return core::text_in(config, option);
}

bool Run::flag(const char* option) const {
    const auto found = config.find(option);
    return found != config.end() && *found == true;
}

int Run::number(const char* option, int least, int most, int absent) const {
    return int(std::clamp(core::number_in(config, option).value_or(absent), double(least), double(most)));
}

fs::path Run::refined_cameras() const {
    const fs::path file = folder / kCamerasFile;
    return core::is_file(file) ? file : fs::path();
}

std::optional<Run> find_run(const fs::path& path) {
    const RunFolder folder(path);
    if (!folder.has(kConfigFile) && !folder.has(kSplatsFile) && !folder.has(kMetricsFile))
        return std::nullopt;
    Run run;
    run.folder = path;
    if (folder.has(kSplatsFile)) run.splats = folder / kSplatsFile;
    run.config = folder.options();
    run.named_dataset = run.text("dataset");
    run.dataset = dataset_of(path, run.named_dataset);
    return run;
}

std::optional<Run> run_of_splats(const fs::path& splats) {
    const std::string name = splats.filename().string();
    if (name != kSplatsFile && !step_of_kept_splats(name)) return std::nullopt;
    const fs::path folder = splats.parent_path();
    if (!RunFolder(folder).has(kConfigFile)) return std::nullopt;
    return find_run(folder);
}

std::optional<fs::path> run_of_file(const fs::path& file) {
    std::error_code error;
    for (const fs::path& path : {file, fs::weakly_canonical(file, error)}) {
        const fs::path folder = path.parent_path();
        if (is_run_file(path.filename().string()) && is_run(folder)) return folder.empty() ? "." : folder;
    }
    return std::nullopt;
}

std::string runs_in(const fs::path& folder) {
    constexpr size_t kNamed = 3;
    std::vector<fs::path> runs;
    std::error_code error;
    for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
        if (is_run(at->path())) runs.push_back(at->path());
    std::ranges::sort(runs);
    std::string text;
    for (size_t i = 0; i < std::min(runs.size(), kNamed); ++i)
        text += (i > 0 ? ", " : "") + core::one_line(runs[i].string());
    if (runs.size() > kNamed) text += " and " + std::to_string(runs.size() - kNamed) + " more";
    return text;
}

}  // namespace ewa::folders
