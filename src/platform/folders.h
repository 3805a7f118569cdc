// SPDX-License-Identifier: Apache-2.0
// Where the system keeps what is the user's.
#pragma once
#include <filesystem>
#include <vector>

namespace ewa::platform {

/// The user's home folder; empty without one. POSIX: $HOME. Windows: the profile.
std::filesystem::path home_folder();

/// Where programs keep the user's settings, each in a folder of its own; empty if the user has no such place.
/// POSIX: $XDG_CONFIG_HOME, or .config in the home folder; relative ones are ignored (XDG Base Directory Specification).
std::filesystem::path settings_folder();

/// Where programs keep what they can make again. POSIX: $XDG_CACHE_HOME, or .cache in the home folder.
std::filesystem::path cache_folder();

/// Where Mesa's drivers keep compiled shaders. Windows, where most drivers are others: empty unless $MESA_SHADER_CACHE_DIR names it.
std::filesystem::path shader_cache_folder();

/// The folders of fonts, the user's own first. Some may not exist.
std::vector<std::filesystem::path> font_folders();

/// Where the Vulkan loader finds files that name drivers. Some may not exist. Windows: none, since they are in its registry.
std::vector<std::filesystem::path> driver_folders();

}  // namespace ewa::platform
