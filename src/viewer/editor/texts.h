// SPDX-License-Identifier: Apache-2.0
// The English texts of the editor, in one place. A translation replaces this file.
#pragma once
#include "viewer/editor/editor.h"

namespace ewa::viewer::texts {

struct ToolText {
    Tool tool;
    const char *name, *key, *hint;  // hint: the tooltip, and the status line while the tool is active
};
inline constexpr ToolText kTools[] = {
    {Tool::view, "View", "Esc", "Drag orbits, right drag moves, wheel zooms"},
    {Tool::rectangle, "Rectangle", "R", "Drag a rectangle; Shift adds, Ctrl removes"},
    {Tool::lasso, "Lasso", "L", "Draw round splats; Shift adds, Ctrl removes"},
    {Tool::polygon, "Polygon", "P", "Click the corners; Enter or a click on the first one ends"},
    {Tool::brush, "Brush", "B", "Paint over splats; [ and ] change the brush"},
    {Tool::sphere, "Sphere", "Shift+S", "Click a centre, drag the handles; Enter selects"},
    {Tool::box, "Box", "Shift+B", "Drag the handles of the box; Enter selects"},
    {Tool::flood, "Flood", "O", "Click a splat: it and those that touch it, of like colour"},
    {Tool::eyedropper, "Eyedropper", "E", "Click a colour: all splats that have it"},
    {Tool::move, "Move", "1", "Drag an arrow; the selection moves, or everything"},
    {Tool::rotate, "Rotate", "2", "Drag a ring"},
    {Tool::scale, "Scale", "3", "Drag the square"},
    {Tool::measure, "Measure", "M", "Click two points; type their true distance to set the unit"},
    {Tool::level, "Level", "G", "Click three points of the ground"},
    {Tool::origin, "Origin", "", "Click the point that becomes 0, 0, 0"},
};

}  // namespace ewa::viewer::texts
