// SPDX-License-Identifier: Apache-2.0
// The strip of the film at the lower border of the picture: its keys on a timeline, its preview, and the dialogs that save films and
// pictures.
#pragma once
#include <memory>
#include <optional>
#include <string>

#include "core/folders.h"
#include "viewer/editor/dialogs.h"
#include "viewer/editor/film.h"
#include "viewer/editor/modal.h"
#include "viewer/navigation.h"
#include "viewer/shown.h"
#include "viewer/view_state.h"

namespace ewa::viewer {

/// Seconds of a steady clock.
double steady_now();

/// The keys of the film are the saved views, in the order of their times.
class FilmStrip {
  public:
    FilmStrip(ViewState& state, Navigation& navigation, Shown& shown, Dialogs& dialogs, FileDialog& files);

    /// Draws the strip. Call it once per frame of ImGui.
    void draw();
    /// Returns whether the key was the strip's.
    bool handle_key(const KeyPress& press);
    /// Undoes the last change of the keys (back), or does it again, unless the strip is hidden or an edit came after it.
    bool undo(bool back) { return shown && history_.step(back, views(), place()); }
    /// Moves the preview by so many seconds of the clock.
    void advance(double seconds);
    /// Takes what the render thread has written, and asks for more. Call it once per turn of the window's loop.
    void take();

    /// Writes the keys to a temporary file for the film of a page. Empty: there are fewer than two, or they cannot be written.
    std::filesystem::path views_file();
    void open_film();
    void open_picture();
    void add_key();
    void play(bool on);

    bool playing() const { return playing_; }
    bool writing() const { return writer_ != nullptr; }
    /// The part of the window that the panel and the strip leave free, px.
    Rectangle area_above() const;

    bool shown = false;
    size_t edits = 0;  // of the scene that are done, by the editor's history

  private:
    /// Where times are on the screen, in ImGui's coordinates.
    struct Scale {
        float left, width;
        double range;  // s, of the width
        float at(double time) const { return left + width * float(time / range); }
        double time(float x) const { return range * double((x - left) / width); }
    };

    std::vector<io::NamedView>& views() { return navigation_.views; }
    double distance() const { return double(state_.settings.film_seconds); }
    FilmPath path() const { return {navigation_.views, distance(), smooth_}; }
    std::optional<size_t> key_at_playhead() const;
    KeyHistory::Place place() const { return {state_.scene.path, edits}; }
    void remember() { history_.remember(views(), place()); }
    void show(double time);
    void replace_key();
    void forget_key();

    void draw_track();
    void use_mouse(const Scale& scale);
    void draw_buttons();
    void draw_settings();
    void draw_progress();
    bool draw_film_dialog();
    bool draw_picture_dialog();
    bool end_dialog(const char* names, bool (FilmStrip::*start)());
    bool start_film();
    bool start_picture();
    void stop_film();

    ViewState& state_;
    Navigation& navigation_;
    Shown& shown_;
    Dialogs& dialogs_;
    FileDialog& files_;
    double playhead_ = 1e9;  // s; the end at first, where new keys belong
    double range_ = 0;       // s, of the track
    std::optional<size_t> dragged_;
    bool moved_ = false;  // the dragged key
    KeyHistory history_;
    std::optional<core::TemporaryFolder> folder_;  // of views_file()
    bool playing_ = false, loop_ = false, smooth_ = true;
    float speed_ = 1;
    Camera last_;       // that the preview has shown
    float height_ = 0;  // of the strip, in ImGui's coordinates
    PathField file_;    // of the open dialog
    bool ffmpeg_ = true;
    FilmOutput output_;
    Size picture_size_{1920, 1080};
    std::unique_ptr<FilmWriter> writer_;
};

}  // namespace ewa::viewer
