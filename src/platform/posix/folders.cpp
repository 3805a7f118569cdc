// SPDX-License-Identifier: Apache-2.0
#include "platform/folders.h"

#include <sstream>

#include "platform/system.h"

namespace ewa::platform {
namespace {

namespace fs = std::filesystem;

/// The absolute folder that a variable names, or one in the home folder, if that is absolute.
fs::path named_folder(const char* name, const char* in_home) {
    if (fs::path named = variable(name); named.is_absolute()) return named;
    const fs::path home = home_folder();
    return home.is_absolute() ? home / in_home : fs::path();
}

std::string variable_or(const char* name, const std::string& otherwise) {
    const std::string value = variable(name);
    return value.empty() ? otherwise : value;
}

}  // namespace

fs::path home_folder() {
    return variable("HOME");
}

fs::path settings_folder() {
    return named_folder("XDG_CONFIG_HOME", ".config");
}

fs::path cache_folder() {
    return variable_or("XDG_CACHE_HOME", (fs::path(variable_or("HOME", "/")) / ".cache").string());
}

fs::path shader_cache_folder() {
    return variable_or("MESA_SHADER_CACHE_DIR", cache_folder().string());
}

std::vector<fs::path> font_folders() {
    std::istringstream places(variable_or("XDG_DATA_HOME", variable("HOME") + "/.local/share") + ":" +
                              variable_or("XDG_DATA_DIRS", "/usr/local/share:/usr/share"));
    std::vector<fs::path> folders;
    for (std::string place; std::getline(places, place, ':');) folders.push_back(fs::path(place) / "fonts");
    return folders;
}

std::vector<fs::path> driver_folders() {
    std::vector<fs::path> folders = {"/usr/local/etc", "/usr/local/share", "/etc", "/usr/share",
                                     fs::path(variable("HOME")) / ".local/share"};
    for (fs::path& folder : folders) folder /= "vulkan/icd.d";
    return folders;
}

}  // namespace ewa::platform
