// SPDX-License-Identifier: Apache-2.0
// The parts of a modal dialog: a window over all others, a field for a path, and buttons that Enter and Esc press.
#pragma once
#include <array>
#include <filesystem>
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

enum class Choice { none, confirm, other, cancel };
/// Draws the buttons that have a text. Enter presses the focused button, or else `confirm`, and nothing where that has none. Esc
/// presses `cancel`. enabled: whether `confirm` is.
Choice draw_choices(const char* confirm, const char* other, const char* cancel, bool enabled = true);

/// A path that people type, or choose in the desktop's dialog.
class PathField {
  public:
    void set(const std::filesystem::path& path);
    /// ~/ is the user's folder.
    std::filesystem::path path() const;
    /// Draws the field and the button "Browse", and below them what is wrong with the path.
    void draw(FileDialog& files);
    /// Takes the answer of the dialog that draw() has opened. Returns whether there was one.
    bool take(FileDialog& files);
    /// Sets the path, and returns whether it can be written. An existing file needs a second call, after a warning. refusal: why it
    /// cannot be written; empty: it can.
    bool accept(const std::filesystem::path& out, const std::string& refusal);
    /// Shows the text until the path changes.
    void complain(const std::string& problem);
    /// Whether the user was warned that the file is replaced.
    bool replaces() const { return replaces_; }

  private:
    std::array<char, 4096> text_{};
    bool asked_ = false, replaces_ = false;
    std::filesystem::path judged_;  // the path that has the problem
    std::string problem_;
};

}  // namespace ewa::viewer
