// SPDX-License-Identifier: Apache-2.0
// The files that were opened last: recent.json beside the settings of the window.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/json.h"
#include "viewer/editor/dialogs.h"
#include "viewer/kept_settings.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostRecent = 10;
constexpr uint64_t kMostRecentBytes = 1u << 16;

fs::path recent_json() {
    const fs::path settings = settings_file();
    return settings.empty() ? settings : settings.parent_path() / "recent.json";
}

}  // namespace

std::vector<fs::path> recent_files() {
    std::vector<fs::path> files;
    try {
        const auto json = core::read_json_file<nlohmann::json>(recent_json(), {.bytes = kMostRecentBytes});
        for (const auto& item : json.at("recent")) {
            if (files.size() == kMostRecent) break;
            const fs::path file = item.is_string() ? item.get<std::string>() : std::string();
            if (file.is_absolute() && std::ranges::find(files, file) == files.end()) files.push_back(file);
        }
    } catch (const std::exception&) {
        // An absent or damaged file names nothing.
    }
    return files;
}

void remember_file(const fs::path& file) {
    const fs::path json_file = recent_json();
    if (json_file.empty() || file.empty()) return;
    std::error_code error;
    const fs::path absolute = fs::absolute(file, error).lexically_normal();
    std::vector<fs::path> files = recent_files();
    std::erase(files, absolute);
    files.insert(files.begin(), absolute);
    if (files.size() > kMostRecent) files.resize(kMostRecent);
    nlohmann::ordered_json json;
    for (const fs::path& recent : files) json["recent"].push_back(recent.string());
    try {
        core::write_json(json_file, json);
    } catch (const std::exception&) {
        // The window works without the file.
    }
}

}  // namespace ewa::viewer
