// SPDX-License-Identifier: Apache-2.0
#include "folders/run_folder.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/json.h"
#include "core/text.h"
#include "ewa/error.h"
#include "folders/former_options.h"

namespace ewa::folders {

namespace fs = std::filesystem;

std::optional<int> step_of_kept_splats(std::string_view name) {
    constexpr std::string_view kBegin = "splats_", kEnd = ".ply";
    if (name.size() <= kBegin.size() + kEnd.size() || !name.starts_with(kBegin) || !name.ends_with(kEnd))
        return std::nullopt;
    const auto step =
        core::parse_integer<int>(name.substr(kBegin.size(), name.size() - kBegin.size() - kEnd.size()));
    // Another file of the user's may have a similar name.
    return step && *step >= 0 && name_of_kept_splats(*step) == name ? step : std::nullopt;
}

std::string name_of_kept_splats(int step) {
    constexpr size_t kDigits = 6;
    const std::string digits = std::to_string(step);
    return "splats_" + std::string(kDigits - std::min(kDigits, digits.size()), '0') + digits + ".ply";
}

bool is_run_file(std::string_view name) {
    return std::ranges::find(kRunFiles, name) != kRunFiles.end() || step_of_kept_splats(name);
}

const fs::path& without_link(const fs::path& path) {
    std::error_code absent;
    if (fs::is_symlink(path, absent)) fs::remove(path, absent);
    return path;
}

bool RunFolder::is_run() const {
    return has(kConfigFile) && (has(kMetricsFile) || has(kSplatsFile) || has(kCheckpointFile));
}

nlohmann::json RunFolder::options() const {
    try {
        auto json = core::read_json_file<nlohmann::json>(path_ / kConfigFile, {.bytes = kMostConfigBytes});
        if (json.is_object()) return with_present_names(std::move(json));
    } catch (const InputError&) {
        // The run is read without what it says.
    }
    return nlohmann::json::object();
}

std::map<int, fs::path> RunFolder::kept_splats() const {
    std::map<int, fs::path> kept;
    std::error_code absent;
    for (const fs::directory_entry& entry : fs::directory_iterator(path_, absent))
        if (const auto step = step_of_kept_splats(entry.path().filename().string()))
            kept[*step] = entry.path();
    return kept;
}

core::FolderLock RunFolder::lock() const {
    core::make_folder(path_);
    return core::FolderLock(path_);
}

void RunFolder::remove_links() const {
    for (const char* folder :
         {kTestFolder, kTrainFolder, kPassersByFolder, kCamerasFolder, "cameras/sparse", kCameraModel})
        without_link(path_ / folder);
    for (const char* file : kRunFiles) without_link(path_ / file);
    for (const char* file : kCameraModelFiles) without_link(path_ / file);
}

void RunFolder::remove_results() const {
    std::error_code absent;
    for (const std::string_view result : kRunFiles)
        if (result != kConfigFile && result != kMetricsFile && result != kSplatsFile)
            fs::remove(path_ / result, absent);
    for (const char* result : kCameraModelFiles) fs::remove(path_ / result, absent);
    for (const auto& [step, file] : kept_splats()) fs::remove(file, absent);
}

bool is_run(const fs::path& folder) {
    return RunFolder(folder).is_run();
}

bool is_made_by_ewa(const fs::path& folder) {
    return core::is_file(folder / kCaptureFile) || is_run(folder);
}

}  // namespace ewa::folders
