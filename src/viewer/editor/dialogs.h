// SPDX-License-Identifier: Apache-2.0
// The dialogs of files: Save as, unsaved work, the journal of a crashed session, recent files, and Publish.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "viewer/editor/editor.h"
#include "viewer/file_dialog.h"

namespace ewa::viewer {

class Dialogs {
  public:
    /// say: shows a message.
    Dialogs(Editor& editor, FileDialog& files, std::function<void()> wake,
            std::function<void(const std::string&)> say);
    ~Dialogs();

    void save();     // to the file that was saved last; the first time as save_as()
    void save_as();  // format, what it loses, file
    void publish();  // page, SOG, streamed levels
    /// The views file of the film's keys, for a page; empty: there are none. May be null. publish() calls it.
    std::function<std::filesystem::path()> views_file;
    /// Asks whether to save unsaved work, in place of another dialog, then calls `go_on`, unless the user cancels. Waits for edits
    /// and a save that are on their way. Calls it at once if there are none, and no unsaved work.
    void leave(std::function<void()> go_on);
    bool leaving() const;  // it asks
    /// Asks whether to restore the edits that a crashed session has left of the active scene, if there are some.
    void offer_journals();
    /// Asks for a file or folder where the desktop has no dialog, then calls `open`. why: what is shown first.
    void ask_path(const std::string& why, std::function<void(const std::filesystem::path&)> open);
    /// Opens a dialog of another part, unless one is open. draw: draws it as a modal, and returns whether it stays open.
    void show(std::function<bool()> draw);
    /// Draws what is open. Call it once per frame of ImGui.
    void draw();
    /// Whether a dialog is open. It then has all keys.
    bool open() const;
    /// Takes the answers of the file dialog and of background work. Call it once per turn of the window's loop. Returns whether
    /// draw() shows something else than before.
    bool take();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// The files that were opened last, newest first, at most ten; in the settings of the user.
std::vector<std::filesystem::path> recent_files();
/// Never throws. Scripted runs do not call it.
void remember_file(const std::filesystem::path& file);

}  // namespace ewa::viewer
