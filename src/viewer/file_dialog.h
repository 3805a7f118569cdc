// SPDX-License-Identifier: Apache-2.0
// The desktop's dialog that asks for a file or a folder, to open or to save.
#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>
#include <string_view>

#include "viewer/latest.h"

namespace ewa::viewer {

enum class Wanted { file, folder, save, scene };  // scene: a file that is added to those that are open

/// Asks through the desktop's portal, or without one through the program zenity or kdialog. Runs on a thread of its own.
class FileDialog {
  public:
    /// wake: called on the thread of the dialog when take() has an answer.
    explicit FileDialog(std::function<void()> wake) : wake_(std::move(wake)) {}
    /// Closes the dialog.
    ~FileDialog() { stop_ = true; }
    FileDialog(const FileDialog&) = delete;
    FileDialog& operator=(const FileDialog&) = delete;

    /// Opens the dialog, unless one is open. proposed: for Wanted::save, the file that the dialog begins with.
    void ask(Wanted wanted, const std::filesystem::path& proposed = {});
    bool open() const { return answer_.running(); }
    /// What the last dialog asked for. So each part of the window takes its own answers.
    Wanted wanted() const { return wanted_; }
    /// Returns the path that the user has chosen, once. Throws RunError if the system has no such dialog.
    std::optional<std::filesystem::path> take();

  private:
    std::function<void()> wake_;
    std::atomic<bool> stop_ = false;
    Wanted wanted_ = Wanted::file;
    Task<std::filesystem::path> answer_;  // its thread ends before the rest
};

/// Asks org.freedesktop.portal.FileChooser on the session bus. Returns false if no portal answers on the bus. chosen: the path;
/// empty if the user has cancelled, or `stop` was set. proposed: as of FileDialog::ask().
bool ask_portal(Wanted wanted, const std::filesystem::path& proposed, const std::atomic<bool>& stop,
                std::filesystem::path& chosen);

/// The path of a file:// URI; empty for anything else.
std::filesystem::path path_of_uri(std::string_view uri);

}  // namespace ewa::viewer
