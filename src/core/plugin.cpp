// SPDX-License-Identifier: Apache-2.0
#include "core/plugin.h"

#include <dlfcn.h>
#include <link.h>

#include <filesystem>
#include <string_view>

#include "core/process.h"
#include "ewa/error.h"

namespace ewa::core {
namespace {

namespace fs = std::filesystem;

/// Where the library is, from the folder of the program or libewa: installed, for programs and for libewa; in
/// a build tree, for programs, tests and the Python package. LD_LIBRARY_PATH and the working folder do not count.
constexpr const char* kFolders[] = {EWA_MODULES_FROM_PROGRAMS, "ewa", "modules", "../modules",
                                    "../../modules"};

/// The shared library that has this function, or else the program. Without symbolic links.
fs::path own_file() {
    Dl_info unused;
    void* found = nullptr;
    dladdr1(reinterpret_cast<const void*>(&own_file), &unused, &found, RTLD_DL_LINKMAP);
    const char* name = found ? static_cast<const link_map*>(found)->l_name : "";  // empty for the program
    std::error_code unknown;
    return *name ? fs::canonical(name, unknown) : own_program();
}

fs::path file_of(const Plugin& plugin) {
    const fs::path own = own_file(), folder = own.parent_path();
    for (const char* place : kFolders) {
        const fs::path file = folder / place / plugin.file;
        std::error_code absent;
        if (fs::exists(file, absent)) return file;
    }
    cannot_load(plugin, "it is neither in " +
                            (folder / EWA_MODULES_FROM_PROGRAMS).lexically_normal().string() +
                            " nor in the folders ewa and modules beside " + own.string());
}

}  // namespace

void cannot_load(const Plugin& plugin, const std::string& reason) {
    throw RunError(std::string(plugin.file) + ", " + plugin.purpose + ", cannot be loaded: " + reason + "; " +
                   plugin.help);
}

// Never unloaded: threads and destructors of the libraries behind it run until the process ends.
const void* load_plugin(const Plugin& plugin, const std::function<void()>& check_room) {
    const fs::path file = file_of(plugin);
    if (check_room) check_room();
    void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!library) cannot_load(plugin, dlerror());
    const void* exported = dlsym(library, plugin.entry);
    if (!exported) cannot_load(plugin, std::string("it belongs to another build of ewa: ") + dlerror());
    const std::string_view version = *static_cast<const char* const*>(exported);
    if (version != EWA_VERSION)
        cannot_load(plugin, "it belongs to ewa " + std::string(version) + ", and this is " EWA_VERSION);
    return exported;
}

}  // namespace ewa::core
