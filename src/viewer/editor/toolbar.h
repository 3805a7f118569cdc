// SPDX-License-Identifier: Apache-2.0
// The bar at the upper border, the strip of tools at the left border of the picture, and the status line at the lower border.
#pragma once
#include <string>

#include "viewer/editor/editor.h"
#include "viewer/layout.h"

namespace ewa::viewer {

/// What the user asked for in the bar.
struct BarActions {
    bool open = false, save = false, save_as = false, clean = false, film = false, publish = false,
         picture = false, help = false, panel = false;
};

/// In px of the framebuffer: what the bars take of the window.
struct BarSizes {
    int top = 0, left = 0, bottom = 0;
};
BarSizes bar_sizes(double text_height);

struct BarFacts {
    bool film_shown = false, panel_shown = false, can_save = false;
    bool live = false;    // a training is watched: edits go to it
    bool points = false;  // the scene is points of a dataset, which cannot be edited
    std::string status;   // at the right of the status line: device, time of the frame
};

/// area: the part of the window beside the panel, with the bars, px of the framebuffer.
BarActions draw_bars(Editor& editor, const BarFacts& facts, const Rectangle& area);

}  // namespace ewa::viewer
