// SPDX-License-Identifier: Apache-2.0
// The bar at the upper border, the strip of tools at the left border of the picture, and the status line at the lower border.
#pragma once
#include "viewer/editor/edit_panel.h"
#include "viewer/editor/timeline.h"

namespace ewa::viewer {

/// In px of the framebuffer: what the bars take of the window.
struct BarSizes {
    int top = 0, left = 0, bottom = 0;
};
BarSizes bar_sizes(double text_height);

/// What the bars show and change.
struct BarParts {
    ViewState& state;
    Editor& editor;
    Dialogs& dialogs;
    FilmStrip& film;
    FileDialog& files;
    EditPanel& panel;
};
void draw_bars(const BarParts& parts);

}  // namespace ewa::viewer
