// SPDX-License-Identifier: Apache-2.0
// The English texts of the editor, in one place. A translation replaces this file.
#pragma once
#include "viewer/editor/editor.h"

namespace ewa::viewer::texts {

// The bars. Each button: its name, its key, and a line about it.
struct ButtonText {
    const char *name, *key, *hint;
};
inline constexpr ButtonText kOpenFile{"Open", "Ctrl+O",
                                      "Splats, photos, a video, a dataset or a run; with Shift a folder"};
inline constexpr ButtonText kSave{"Save", "Ctrl+S", "Shift or a right click: to another file"};
inline constexpr ButtonText kUndo{"Undo", "Ctrl+Z", "Takes the last edit back"};
inline constexpr ButtonText kRedo{"Redo", "Ctrl+Shift+Z", "Does again what was undone"};
inline constexpr ButtonText kClean{"Clean", "", "Finds floaters, far, faint and huge splats"};
inline constexpr ButtonText kFilm{"Film", "", "A flight through the scene as a video"};
inline constexpr ButtonText kPublish{"Publish", "", "A web page, a small file, or streamed levels"};
inline constexpr ButtonText kPicture{"Picture", "F12", "Writes what you see as a PNG; with Shift as an EXR"};
inline constexpr ButtonText kPanel{"Panel", "F2", "Shows or hides the panel"};
inline constexpr ButtonText kHelp{"Help", "F1", "All keys"};
inline constexpr const char *kSaveAs = "Save as ...", *kMore = "More", *kSaving = "saving ...";
inline constexpr const char *kSelected = "selected", *kWouldBeSelected = "would be selected";
inline constexpr const char* kEditsTraining = "edits go to the training";

// The panel.
inline constexpr const char *kTabView = "View", *kTabEdit = "Edit";
inline constexpr const char *kLook = "Look", *kTraining = "Training", *kCameras = "Cameras",
                            *kSavedViews = "Saved views", *kDetails = "Details", *kWindow = "Window";
inline constexpr const char* kModes =
    "Colour\0Depth\0Opacity\0Splats per pixel\0Ellipsoids\0Median depth\0Normals\0";
inline constexpr const char* kKernels = "Peak (3DGS)\0Antialias\0Density (EWA)\0Points (spheres)\0";
inline constexpr const char* kComparisons = "Nothing\0Side by side\0Wipe\0Difference\0";
inline constexpr const char* kThemes = "Dark\0Light\0";

// The empty window.
inline constexpr const char* kDropTitle = "Drop photos, a video or splats";
inline constexpr const char* kDropExplanation = "or a dataset, or a training run";
inline constexpr const char *kOpenAFile = "Open a file", *kOpenAFolder = "Open a folder", *kRecent = "Recent",
                            *kKeysLine = "F1: keys";

// Help (F1). The keys of tools are those of kTools.
struct HelpRow {
    const char *keys, *text;
};
inline constexpr HelpRow kMoveHelp[] = {
    {"left drag", "orbit the scene"},
    {"Ctrl + left drag", "look around"},
    {"right or middle drag", "move sideways"},
    {"wheel", "move closer or farther"},
    {"double click", "look at this point and orbit it"},
    {"W S  A D  Q E", "fly: forward, back; left, right; down, up"},
    {"Shift", "fly four times as fast"},
    {"F", "show the whole scene from the front"},
    {"R", "return to the first view"},
    {"T", "turntable"},
    {"P", "parallel rays"},
    {"U", "change the up axis"},
};
inline constexpr HelpRow kLookHelp[] = {
    {"1 to 7", "colour, depth, opacity, splats per pixel, ellipsoids, median depth, normals"},
    {"- +", "make splats smaller, larger"},
    {"C", "show cameras; a click goes to one"},
    {"left right", "go to the previous, next camera"},
    {"G", "go to the nearest camera"},
    {"V", "compare with the image: side by side, wipe, difference"},
    {"M", "measure: click two points"},
};
inline constexpr HelpRow kFilesHelp[] = {
    {"drop a file", "open it; a dataset gives its cameras to splats"},
    {"Ctrl + O", "open a file; with Shift: a folder"},
    {"Ctrl + 1 to 9", "save this view under a number"},
    {"Shift + 1 to 9", "go to the saved view"},
    {"F12", "screenshot (PNG); with Shift: EXR"},
    {"F1", "show or hide these keys"},
    {"F2", "show or hide the panel"},
    {"Ctrl + Q", "quit"},
};
inline constexpr const char *kMoveGroup = "Move around", *kLookGroup = "Look",
                            *kFilesGroup = "Views and files", *kToolsGroup = "Edit";

// The tools.
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
