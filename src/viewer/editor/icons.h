// SPDX-License-Identifier: Apache-2.0
// The icons of the window. They are lines in a grid of 24 units, so that they are sharp in any size.
#pragma once
#include "viewer/editor/edit_settings.h"

struct ImVec2;

namespace ewa::viewer {

/// Those of the tools are before these: Icon(tool).
enum class Icon {
    open = int(Tool::origin) + 1,
    save,
    undo,
    redo,
    clean,
    film,
    publish,
    picture,
    help,
    panel,
    eye,
    eye_off,
    more,
    drop
};

/// Draws into the present window of ImGui. size: of the whole grid, in ImGui's coordinates. color: ImU32.
void draw_icon(Icon icon, const ImVec2& center, float size, unsigned color);

/// A flat square button in the present line. Returns whether it is clicked. The icon is its ID: two buttons with one icon need
/// another ImGui::PushID.
/// tooltip, keys: as of ui::show_hint().
/// active: the button stays lit. side: of the square.
bool icon_button(Icon icon, const char* tooltip, bool active, bool enabled, float side,
                 const char* keys = "");

}  // namespace ewa::viewer
