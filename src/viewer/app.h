// SPDX-License-Identifier: Apache-2.0
// The viewer's window thread: turns input into requests, and finished frames into what the window shows.
#pragma once
#include <memory>

#include "viewer/editor/tools.h"
#include "viewer/panel.h"
#include "viewer/screen.h"

namespace ewa::viewer {

class App {
  public:
    /// Opens the window. Throws RunError.
    explicit App(const Startup& startup);

    /// Runs until the window is closed or the requested files are written. Throws RunError, InputError.
    void run();
    /// The settings that the next session starts with.
    KeptSettings kept() const;

  private:
    double patience() const;
    void change_text();

    // Input.
    void handle_key(const KeyPress& press);
    void handle_mouse();

    // One frame of the window.
    void draw();
    bool present(ImDrawData* drawn, Image* capture);
    void panel();
    void draw_overlays();
    void draw_editor();

    // The editor.
    bool editing() const;  // the keys are those of the tools
    bool live() const;     // edits go to a training
    void sync_editor();
    void take_chosen();
    std::vector<edit::Step> unsent_steps() const;
    void enter_scene();
    void add_scene();
    void send_edits();
    bool keeps_edits() const;
    void open(const std::vector<std::filesystem::path>& paths, const OpenedScene& shown);

    ViewState state_;
    std::unique_ptr<Screen> screen_;
    bool dragging_wipe_ = false;
    Navigation navigation_;
    Shown shown_;
    ViewSession session_;
    Editor editor_;
    Tools tools_;
    EditPanel edit_panel_;
    Dialogs dialogs_;
    FilmStrip film_;
    const WindowParts parts_{state_, navigation_, shown_, session_, editor_, edit_panel_, dialogs_, film_};
    std::shared_ptr<const Gaussians> entered_,
        drawn_;                     // the scene that is edited, and what of it the render thread has
    std::filesystem::path opened_;  // the last file that was remembered
    std::shared_ptr<const Gaussians> drafted_;  // the draft of it that the render thread has
    bool marked_ = false;                       // the render thread has marks
    Tool last_tool_ = Tool::view;
    Task<OpenedScene> added_;  // that is being opened beside the others
    size_t sent_before_ = 0;   // EditSettings::sent before the last edit that was sent
    uint64_t answered_ = 0;    // edits that the training has answered
};

}  // namespace ewa::viewer
