// SPDX-License-Identifier: Apache-2.0
// The user's desktop: whether there is one, what it opens, and its dialog for files.
#pragma once
#include <atomic>
#include <filesystem>
#include <string>

namespace ewa::platform {

/// Whether windows can be opened. POSIX: whether the environment names a desktop session, X11 or Wayland.
bool has_desktop();

/// Opens a file in the program that the desktop has for it, which lives on after this one. Returns why not; empty if it did.
/// remedy: where xdg-open is missing, how to get it.
std::string open_outside(const std::filesystem::path& file, const std::string& remedy);

enum class Choice { file, folder, save };

/// Asks with the dialog that belongs to the system itself. Returns false if there is none, as on Linux, where desktops have their
/// own. proposed: the file that Choice::save begins with. chosen: empty if the user has cancelled. The dialog closes when `stop` is
/// set.
bool choose(Choice choice, const std::filesystem::path& proposed, const std::atomic<bool>& stop,
            std::filesystem::path& chosen);

}  // namespace ewa::platform
