// SPDX-License-Identifier: Apache-2.0
// The tab "Edit" of the panel: selection, transform, colours, cleaning, histogram, scenes and history.
#pragma once
#include "viewer/editor/panel_sections.h"

namespace ewa::viewer {

struct ViewState;

class EditPanel {
  public:
    /// Draws the rows into the present window of ImGui. The look becomes plain while the controls of colours are shown, so that the
    /// selection is to be seen without its tint.
    void draw(Editor& editor, ViewState& state);
    /// Opens the section of cleaning.
    void show_cleaning() { show_cleaning_ = true; }

  private:
    SelectionSection selection_;
    MoveSection move_;
    ColourSection colours_;
    CleanSection clean_;
    HistogramSection histogram_;
    bool show_cleaning_ = false;
};

}  // namespace ewa::viewer
