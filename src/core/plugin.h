// SPDX-License-Identifier: Apache-2.0
// Small libraries of ewa that are loaded when they are needed. Each links a large library, which the programs do not.
#pragma once
#include <functional>
#include <string>

namespace ewa::core {

struct Plugin {
    const char* file;     // "libewa_mpi.so"
    const char* entry;    // the name of the table of functions that it exports
    const char* purpose;  // for messages: "which lets processes train together"
    const char* help;     // for messages: what to install
};

/// Throws RunError: the library cannot be loaded, with the reason and a remedy.
[[noreturn]] void cannot_load(const Plugin& plugin, const std::string& reason);

/// Loads the library from its folder beside the program or libewa, and returns what it exports. That begins with the
/// library's version, a const char*, which must be EWA_VERSION. check_room: is called before the library is loaded,
/// once it is found. The library stays until the process ends. Throws RunError where there is no such library, or it
/// does not fit.
const void* load_plugin(const Plugin& plugin, const std::function<void()>& check_room = {});

}  // namespace ewa::core
