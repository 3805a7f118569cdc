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

}  // namespace ewa::viewer
