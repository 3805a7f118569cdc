// SPDX-License-Identifier: Apache-2.0
// The tab "Edit" of the panel: selection, transform, colours, cleaning, histogram, scenes and history.
#pragma once
#include <utility>

#include "viewer/editor/panel_sections.h"

namespace ewa::viewer {

class EditPanel {
  public:
    /// Draws the rows into the present window of ImGui. live: a training is watched, and edits go to it.
    void draw(Editor& editor, bool live);
    /// Opens the section of cleaning.
    void show_cleaning() { show_cleaning_ = true; }
    /// Whether the last draw() has shown the controls of colours, so that the selection is to be seen without its tint.
    bool shows_colours() const { return shows_colours_; }
    /// Whether the last draw() has shown something that changes soon, so that another frame is due. Once for each draw().
    bool take_redraw() { return std::exchange(redraw_, false); }

  private:
    SelectionSection selection_;
    MoveSection move_;
    ColourSection colours_;
    CleanSection clean_;
    HistogramSection histogram_;
    bool show_cleaning_ = false, shows_colours_ = false, redraw_ = false;
};

}  // namespace ewa::viewer
