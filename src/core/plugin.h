// SPDX-License-Identifier: Apache-2.0
// Loads ewa's plugins, when they are needed. A plugin is a small library of ewa that links a large one, such as MPI, so that the
// programs need not link it.
#pragma once
#include <filesystem>
#include <functional>
#include <string>

#include "core/packages.h"

namespace ewa::core {

struct Plugin {
    const char* name;            // of its file, without the system's ending: "libewa_mpi"
    const char* entry;           // the name of the table of functions that it exports
    const char* purpose;         // for messages: "which lets processes train together"
    Thing library;               // that it links
    const char* otherwise = "";  // for messages: ", or what helps without it"
};

/// Where plugins are beside the program or libewa: the file of this name there, or an empty path. LD_LIBRARY_PATH and the working
/// folder do not count.
std::filesystem::path file_beside(const std::string& name);

/// The name of the library's file: "libewa_mpi.so".
std::string file_name(const Plugin& plugin);

/// Throws RunError: the library cannot be loaded, with the reason and a remedy.
[[noreturn]] void cannot_load(const Plugin& plugin, const std::string& reason);

/// Loads the library from its folder beside the program or libewa, and returns its exported table. The table begins with
/// the library's version, a const char*, which must be EWA_VERSION. check_room: called after the library is found and
/// before it is loaded. The library stays loaded until the process ends. Throws RunError if the library does not exist,
/// or has another version.
const void* load_plugin(const Plugin& plugin, const std::function<void()>& check_room = {});

}  // namespace ewa::core
