// SPDX-License-Identifier: Apache-2.0
#include "viewer/kept_settings.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/json.h"
#include "core/json_field.h"
#include "ewa/error.h"
#include "platform/folders.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr uint64_t kMostSettingsBytes = 1u << 16;
constexpr int kLeastSide = 200, kMostSide = 16384;  // px of a window

/// The number of this name, if it is one in the range.
template <class T>
void take(const Json& json, const char* name, T least, T most, T& value) {
    const auto number = core::number_in(json, name);
    if (number && *number >= double(least) && *number <= double(most)) value = T(*number);
}

}  // namespace

fs::path settings_file() {
    const fs::path folder = platform::settings_folder();
    return folder.empty() ? folder : folder / "ewa/view.json";
}

KeptSettings read_settings(const fs::path& file) {
    KeptSettings settings;
    try {
        const Json json = core::read_json_file<Json>(file, {.bytes = kMostSettingsBytes});
        Size window;
        take(json, "window_width", kLeastSide, kMostSide, window.width);
        take(json, "window_height", kLeastSide, kMostSide, window.height);
        if (window.width > 0 && window.height > 0) settings.window = window;
        take(json, "text_scale", kLeastText, kMostText, settings.text_scale);
        take(json, "gain", 1.0f, 16.0f, settings.gain);
        take(json, "film_seconds", 0.2f, 10.0f, settings.film_seconds);
        settings.light = core::text_in(json, "theme") == "light";
    } catch (const std::exception&) {
        return {};
    }
    return settings;
}

void write_settings(const fs::path& file, const KeptSettings& settings) {
    if (file.empty()) return;
    Json json{{"text_scale", settings.text_scale},
              {"gain", settings.gain},
              {"film_seconds", settings.film_seconds},
              {"theme", settings.light ? "light" : "dark"}};
    if (settings.window) {
        json["window_width"] = settings.window->width;
        json["window_height"] = settings.window->height;
    }
    try {
        core::write_json(file, json);
    } catch (const std::exception&) {
        // The next session starts with the usual settings.
    }
}

}  // namespace ewa::viewer
