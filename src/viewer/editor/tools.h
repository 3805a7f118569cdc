// SPDX-License-Identifier: Apache-2.0
// The tools of the editor over the picture: what the mouse and the keys do while a tool is active, and the lines that it draws.
#pragma once
#include <memory>

#include "viewer/editor/editor.h"
#include "viewer/navigation.h"
#include "viewer/shown.h"
#include "viewer/window.h"

namespace ewa::viewer {

class Tools {
  public:
    Tools(ViewState& state, Navigation& navigation, Shown& shown, Editor& editor);
    ~Tools();

    /// Call it in a frame of ImGui while no item of ImGui has the mouse. Returns whether the tool has used the mouse, so that it
    /// moves no camera.
    bool handle_mouse();
    /// Returns whether the key was the tool's.
    bool handle_key(const KeyPress& press);
    /// Draws the handles, the lines of a selection in progress, and the brush under the pointer.
    void draw();
    /// Takes a surface point that the tool has asked for (PointUse::edit, color). Returns whether it was the tool's.
    bool take_point(const SurfacePoint& point);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace ewa::viewer
