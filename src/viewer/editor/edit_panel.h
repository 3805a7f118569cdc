// SPDX-License-Identifier: Apache-2.0
// The tab "Edit" of the panel: selection, transform, colours, cleaning, histogram, scenes and history.
#pragma once
#include <memory>

#include "viewer/editor/editor.h"

namespace ewa::viewer {

class EditPanel {
  public:
    EditPanel();
    ~EditPanel();
    /// Draws the rows into the present window of ImGui. live: a training is watched, and edits go to it.
    void draw(Editor& editor, bool live);
    /// Opens the section of cleaning.
    void show_cleaning();
    /// Whether the last draw() has shown the controls of colours, under which a selection is drawn without its tint.
    bool shows_colours() const;
    /// Whether the last draw() has shown something that changes soon, so that another frame is due. Once for each draw().
    bool take_redraw();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace ewa::viewer
