// SPDX-License-Identifier: Apache-2.0
// The panel at the left of the window.
#pragma once
#include <string>

#include "viewer/editor/edit_panel.h"
#include "viewer/editor/timeline.h"
#include "viewer/view_session.h"

namespace ewa::viewer {

/// What the panel and the bars show and change.
struct WindowParts {
    ViewState& state;
    Navigation& navigation;
    Shown& shown;
    ViewSession& session;
    Editor& editor;
    EditPanel& edits;
    Dialogs& dialogs;
    FilmStrip& film;

    const RenderedFrame* picture() const { return shown.renders.shown().get(); }  // null: none yet
};

void draw_panel(const WindowParts& parts);

/// The section of a training run, or of a dataset that one can be started on. Part of draw_panel().
void draw_training(const WindowParts& parts);

/// Draws a label. The next item gets the rest of the line.
void label_field(const char* label);
/// Draws the heading of a section that folds. open: whether it is open at first. open_now: opens it. Returns whether it is open.
bool draw_section(const char* name, bool open, bool open_now = false);
/// The number of lines of text that wraps at the border of the window; not more than `most`.
int text_lines(const std::string& text, int most);
/// Draws text that wraps, in a box of `least` to `most` lines. It scrolls if it has more.
void draw_text_box(const char* name, const std::string& text, int least, int most);

/// The next of the six axes; the first one if `up` is not an axis.
glm::dvec3 next_up(const glm::dvec3& up);

}  // namespace ewa::viewer
