// SPDX-License-Identifier: Apache-2.0
#include "core/plugin.h"

#include <filesystem>
#include <string_view>

#include "ewa/error.h"
#include "platform/library.h"

namespace ewa::core {
namespace {

namespace fs = std::filesystem;

/// Where plugins are, from the folder of the program or libewa: installed, for programs and for libewa; in a build tree, for
/// programs, tests and the Python package.
constexpr const char* kFolders[] = {EWA_MODULES_FROM_PROGRAMS, "ewa", "modules", "../modules",
                                    "../../modules"};

fs::path own_file() {
    std::error_code unknown;
    fs::path own = platform::own_file(unknown);
    if (unknown) throw RunError("cannot find where this program is: " + unknown.message());
    return own;
}

fs::path file_of(const Plugin& plugin) {
    fs::path file = file_beside(file_name(plugin));
    if (!file.empty()) return file;
    const fs::path own = own_file();
    cannot_load(plugin, "it is neither in " +
                            (own.parent_path() / EWA_MODULES_FROM_PROGRAMS).lexically_normal().string() +
                            " nor in the folders ewa and modules beside " + own.string());
}

}  // namespace

fs::path file_beside(const std::string& name) {
    const fs::path folder = own_file().parent_path();
    for (const char* place : kFolders) {
        fs::path file = folder / place / name;
        std::error_code absent;
        if (fs::exists(file, absent)) return file;
    }
    return {};
}

std::string file_name(const Plugin& plugin) {
    return std::string(plugin.name) + platform::kLibrarySuffix;
}

void cannot_load(const Plugin& plugin, const std::string& reason) {
    throw RunError(file_name(plugin) + ", " + plugin.purpose + ", cannot be loaded: " + reason + "; " +
                   how_to_install_module(plugin.library) + plugin.otherwise);
}

const void* load_plugin(const Plugin& plugin, const std::function<void()>& check_room) {
    const fs::path file = file_of(plugin);
    if (check_room) check_room();
    platform::Library library(file);
    if (!library) cannot_load(plugin, library.error());
    const void* exported = library.find(plugin.entry);
    if (!exported) cannot_load(plugin, "it belongs to another build of ewa: " + library.error());
    const std::string_view version = *static_cast<const char* const*>(exported);
    if (version != EWA_VERSION)
        cannot_load(plugin, "it belongs to ewa " + std::string(version) + ", and this is " EWA_VERSION);
    return exported;
}

}  // namespace ewa::core
