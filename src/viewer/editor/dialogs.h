// SPDX-License-Identifier: Apache-2.0
// The dialogs of files: Save as, unsaved work, the journal of a crashed session, recent files, and Publish.
#pragma once
#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "io/splats/format_table.h"
#include "viewer/editor/publish_dialog.h"

namespace ewa::viewer {

struct ViewState;

class Dialogs {
  public:
    Dialogs(ViewState& state, Editor& editor, FileDialog& files);

    void save();     // to the file that was saved last; the first time as save_as()
    void save_as();  // format, what it loses, file
    /// Page, SOG, streamed levels. views: the file of the film's keys, for a page; empty: there are none.
    void publish(const std::filesystem::path& views);
    /// Asks whether to save unsaved work, in place of another dialog, then calls `go_on`, unless the user cancels. Waits for edits
    /// and a save that are on their way. Calls it at once if there are none, and no unsaved work.
    void leave(std::function<void()> go_on);
    bool leaving() const { return shown_ == &Dialogs::draw_leave; }  // it asks
    /// Asks whether to restore the edits that a crashed session has left of the active scene, if there are some.
    void offer_journals() { offers_ = true; }
    /// Asks for a file or folder where the desktop has no dialog, then calls `open`. why: what is shown first.
    void ask_path(const std::string& why, std::function<void(const std::filesystem::path&)> open);
    /// Opens a dialog of another part, unless one is open. draw: draws it as a modal, and returns whether it stays open.
    void show(std::function<bool()> draw);
    /// Draws what is open. Call it once per frame of ImGui.
    void draw();
    /// Whether a dialog is open. It then has all keys.
    bool open() const { return shown_ != nullptr; }
    /// Takes the answers of the file dialog and of background work. Call it once per turn of the window's loop.
    void take();

  private:
    const EditedScene& scene() const { return editor_.scene(editor_.active()); }
    std::filesystem::path target() const;
    std::vector<std::filesystem::path> originals() const;
    void write(const std::filesystem::path& out, bool all_scenes);
    void pass(const std::function<void()>& on);
    void confirm_save();
    void ask_or_pass();
    void draw_formats(const Gaussians* splats, size_t count);
    void draw_losses(const Gaussians& splats) const;
    bool draw_open(const std::function<void(const std::filesystem::path&)>& open);
    void draw_save();
    void draw_publish();
    void draw_leave();
    void draw_journal();
    void draw_saving();
    void draw_other();

    ViewState& state_;
    Editor& editor_;
    FileDialog& files_;
    PublishDialog publish_;
    void (Dialogs::*shown_)() = nullptr;  // draws what is open; null: nothing
    bool drawn_ = false;                  // in the last frame
    bool keyboard_ = false;               // ImGui's keyboard navigation is on for a dialog

    // Save as.
    const io::FormatRow* row_ = nullptr;
    bool all_ = false;
    PathField path_;
    struct Saved {
        std::filesystem::path original, file;
        std::string name;
        bool all = false;
    } last_;
    std::set<std::filesystem::path> written_;  // by this session, so they are no originals

    std::function<bool()> draw_other_;  // a dialog of another part
    std::function<void()> go_on_;       // after the save; null: nothing
    bool offers_ = false;               // journals are looked for
    std::vector<Editor::Left> left_;
};

/// The files that were opened last, newest first, at most ten; in the settings of the user.
std::vector<std::filesystem::path> recent_files();
/// Never throws. Scripted runs do not call it.
void remember_file(const std::filesystem::path& file);

}  // namespace ewa::viewer
