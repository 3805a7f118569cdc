// SPDX-License-Identifier: Apache-2.0
// The parts of a modal dialog: a window over all others, a form, a field for a path, and buttons that Enter and Esc press.
#pragma once
#include <array>
#include <filesystem>
#include <span>
#include <string>

#include "viewer/file_dialog.h"

namespace ewa::viewer {

/// Begins the modal, in the middle of the window. A modal that is larger than the window scrolls. end_modal() follows if it returns
/// true.
bool begin_modal(const char* title);
/// stays: the modal is drawn in the next frame too.
void end_modal(bool stays);
/// Closes the modal that was open in the frame before, if there is one.
void close_modal();

/// The width of the contents, in ImGui's coordinates.
float modal_width();

/// Wrapped text. warning: in the colour of warnings.
void modal_text(const std::string& text, bool warning = false);

/// Text in a box of so many lines, which scrolls if it has more.
void modal_box(const char* name, const std::string& text, int lines);

/// A radio button with a border. Returns whether it is clicked.
bool modal_radio(const char* name, bool chosen);

/// A button in the colour of the accent. width: in ImGui's coordinates; 0: that of the text. Returns whether it is clicked.
bool accent_button(const char* text, float width = 0);

/// Fills the space down to `height` below `top`, a vertical position of the cursor. What follows stays where it is.
void reserve(float top, float height);

class PathField;
/// Begins a table of fields with their labels, of which the first is the file. files: as of PathField::draw(). end_form() follows if it
/// returns true.
bool begin_form(PathField& file, FileDialog* files);
/// A row. The next item is its field.
void form_row(const char* label);
/// A row with a list of names. chosen: an index, or -1 for a value that has no name. Returns whether it has changed.
bool form_list(const char* label, std::span<const std::string> names, int& chosen);
void end_form();

enum class Choice { none, confirm, other, cancel };
/// Draws the buttons that have a text. Enter presses the focused button, or else `confirm`, and nothing where that has none. Esc
/// presses `cancel`. enabled: whether `confirm` is.
Choice draw_choices(const char* confirm, const char* other, const char* cancel, bool enabled = true);
/// Enter (`confirm`) or Esc (`cancel`), for the modal. ImGui may miss a key that is pressed and released between two frames.
void press_modal(Choice key);

/// A path that people type, or choose in the desktop's dialog.
class PathField {
  public:
    void set(const std::filesystem::path& path);
    /// ~/ is the user's folder.
    std::filesystem::path path() const;
    /// Draws the field, and below it what is wrong with the path. files: of the button "Browse"; null: it has none.
    void draw(FileDialog* files);
    /// Takes the answer of the dialog that draw() has opened.
    void take(FileDialog& files);
    /// Sets the path, and returns whether it can be written. An existing file needs a second call, after a warning. refusal: why it
    /// cannot be written; empty: it can.
    bool accept(const std::filesystem::path& out, const std::string& refusal);
    /// Shows the text until the path changes. The keys go to the field then.
    void complain(const std::string& problem);
    /// Whether the user was warned that the file is replaced.
    bool replaces() const { return replaces_; }

  private:
    std::array<char, 4096> text_{};
    bool asked_ = false, replaces_ = false, focus_ = false;
    std::filesystem::path judged_;  // the path that has the problem
    std::string problem_;
};

}  // namespace ewa::viewer
