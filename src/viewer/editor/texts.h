// SPDX-License-Identifier: Apache-2.0
// The English texts of the editor, in one place. A translation replaces this file.
#pragma once
#include <span>
#include <string_view>

#include "viewer/editor/edit_settings.h"

namespace ewa::viewer::texts {

/// A control: its name, its tooltip, and its keys, as in "Ctrl+D or Ctrl+Shift+A". An edit without a shape also has its words.
struct Item {
    const char* name;
    const char *hint = "", *keys = "", *edit = "", *value = "";
    bool of_selection = false;  // it does nothing without one
};

// The bars.
inline constexpr Item kOpenFile{"Open", "Splats, photos, a video, a dataset or a run; with Shift a folder",
                                "Ctrl+O"},
    kSave{"Save", "Shift or a right click: to another file", "Ctrl+S"},
    kUndo{"Undo", "Takes the last edit back", "Ctrl+Z"},
    kRedo{"Redo", "Does again what was undone", "Ctrl+Shift+Z or Ctrl+Y"},
    kClean{"Clean", "Finds floaters, far, faint and huge splats"},
    kFilm{"Film", "A flight through the scene as a video"},
    kPublish{"Publish", "A web page, a small file, or streamed levels"},
    kPicture{"Picture", "Writes what you see as a PNG; with Shift as an EXR", "F12"},
    kPanel{"Panel", "Shows or hides the panel", "F2"}, kHelp{"Help", "All keys", "F1"};
inline constexpr const char *kSaveAs = "Save as ...", *kMore = "More", *kSaving = "saving ...";
inline constexpr const char *kUndone = "Undone: ", *kRedone = "Redone: ",
                            *kNothingSelected = "Nothing is selected.";
inline constexpr const char *kSelected = "selected", *kWouldBeRemoved = "would be removed";
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

// The tools, in the order of Tool.
struct ToolText {
    Tool tool;
    const char *name, *key, *hint;  // hint: the tooltip, and the status line while the tool is active
};
inline constexpr ToolText kTools[] = {
    {Tool::view, "View", "Esc", "Drag orbits, right drag moves, wheel zooms"},
    {Tool::rectangle, "Rectangle", "R", "Drag a rectangle; Shift adds, Ctrl removes, both intersect"},
    {Tool::lasso, "Lasso", "L", "Draw round splats; Shift adds, Ctrl removes, Esc cancels"},
    {Tool::polygon, "Polygon", "P",
     "Click the corners; Enter, a double click or the first corner ends, Backspace takes one back"},
    {Tool::brush, "Brush", "B", "Paint over splats; Shift adds, Ctrl removes, [ and ] change the brush"},
    {Tool::sphere, "Sphere", "N", "Click a centre, drag the handles; Enter selects, Esc takes a drag back"},
    {Tool::box, "Box", "X", "Drag the handles of the box; Enter selects, Esc takes a drag back"},
    {Tool::flood, "Flood", "O",
     "Click a splat: it and those that touch it, of like colour, not faint; Shift adds, Ctrl removes"},
    {Tool::eyedropper, "Eyedropper", "I", "Click a splat: all of its colour; Shift adds, Ctrl removes"},
    {Tool::move, "Move", "1", "Drag an arrow: the selection moves, or everything; Shift snaps, Esc cancels"},
    {Tool::rotate, "Rotate", "2", "Drag a ring; Shift snaps to 15 degrees, Esc cancels"},
    {Tool::scale, "Scale", "3", "Drag the middle to scale, an end to stretch; Shift snaps, Esc cancels"},
    {Tool::measure, "Measure", "M", "Click two points; type their true length, Enter sets the unit"},
    {Tool::level, "Level", "G",
     "Click three points of the ground, Backspace takes one back; Enter finds the ground"},
    {Tool::origin, "Origin", "", "Click the point that becomes 0, 0, 0"},
};

// The panel.
namespace edit_panel {

inline constexpr Item kSelection{"Selection", "Which splats the edits below change"},
    kMove{"Move", "Numbers for the selection, or for everything if nothing is selected"},
    kColours{"Colours", "Of the selection, or of everything if nothing is selected"},
    kClean{"Clean", "Finds splats that no scene needs"}, kHistogram{"Histogram", "Select splats by a value"},
    kScenes{"Scenes", "The file, and what Separate has made of it"},
    kHistory{"History", "All edits; a click goes there"};
inline constexpr const char *kNoScene = "Open splats to edit them.", *kLive = "Edits go to the training.";

// Selection.
inline constexpr Item kAll{"All", "Select all splats", "Ctrl+A", "select", "all"},
    kNone{"None", "Select nothing", "Ctrl+D or Ctrl+Shift+A", "select", "none"},
    kInvert{"Invert", "Select the others", "Ctrl+I", "select", "invert"};
inline constexpr Item kOperations[] = {{"Set", "A new shape replaces the selection"},
                                       {"Add", "A new shape joins the selection (Shift)"},
                                       {"Remove", "A new shape leaves the selection (Ctrl)"},
                                       {"Intersect", "Only what is also in a new shape stays (Shift+Ctrl)"}};
inline constexpr Item kFront{"Front only", "Only splats that others do not cover"},
    kExtent{"By extent", "A splat counts if any part of it is in the shape, not its centre alone"},
    kBrush{"Brush", "Radius of the brush ([ and ])"},
    kTolerance{"Tolerance", "How far colours may differ, for Flood and Eyedropper"},
    kDistance{"Distance", "By how much to grow or shrink, world units"},
    kGrow{"Grow", "Also select what is within the distance (by key: 1 %)", "Ctrl+=", "select", "grow", true},
    kShrink{"Shrink", "Deselect what is near other splats (by key: 1 %)", "Ctrl+-", "select", "shrink", true};
inline constexpr Item kLock{"Lock", "The selection is drawn, and no edit changes it", "H", "lock", "", true},
    kUnlock{"Unlock all", "Edits change locked splats again", "Shift+H", "unlock"},
    kHide{"Hide", "The selection is not drawn", "Ctrl+H", "hide", "", true},
    kShow{"Show all", "Draw hidden splats again", "Ctrl+Shift+H", "unhide"},
    kDelete{"Delete", "Remove the selection. Undo brings it back", "Del or Backspace", "delete", "", true},
    kDuplicate{"Duplicate", "Copy the selection, and select the copy", "", "duplicate", "", true},
    kSeparate{"Separate", "Make the selection a scene of its own"},
    kReset{"Reset", "Give the selection the values of the file back", "", "reset", "", true},
    kFreeze{"Freeze", "The training changes the selection no more", "", "lock", "", true},
    kUnfreeze{"Unfreeze all", "The training changes all splats again", "", "unlock"};
/// The edits that a key does.
inline constexpr Item kKeyedEdits[] = {kAll,  kNone,   kInvert, kGrow, kShrink,
                                       kLock, kUnlock, kHide,   kShow, kDelete};
// Braces are numbers, as in {fmt}.
inline constexpr const char *kSelectedOf = "{} of {} selected", *kLockedAndHidden = "{} locked, {} hidden";
inline constexpr Item kBoxLow{"Low corner of the box", "World units"},
    kBoxHigh{"High corner of the box", "World units"}, kCentre{"Centre of the sphere", "World units"},
    kRadius{"Radius", "World units"}, kCopy{"Copy", "Copy the numbers as text"},
    kPaste{"Paste", "Take the numbers of a text: box=... or sphere=..."},
    kWholeScene{"Whole scene", "Around all splats"}, kAroundSelection{"Selection", "Around the selection"},
    kSelect{"Select", "Select what is inside", "Enter"}, kCrop{"Crop", "Delete all that is outside"};
inline constexpr const char *kByShape = "{} by {}", *kRectangle = "rectangle";

// Move and colours.
inline constexpr Item kPosition{"Position of the middle", "World units. Enter applies"},
    kTurn{"Turn about x, y, z", "Degrees, about the middle. Enter applies"},
    kScale{"Scale", "Factor, about the middle. Enter applies"},
    kApply{"Apply", "Make these changes", "Enter"};
inline constexpr const char* kRotate = "Rotate";
inline constexpr Item kAxes[] = {{"World", "Arrows and rings follow the world's axes"},
                                 {"Local", "Arrows and rings follow the selection's axes"}};
inline constexpr const char* kWholeSceneTools = "The whole scene: level it, set its unit, choose its origin";
inline constexpr const char* kPlainColours = "The selection is shown without its tint.";
inline constexpr Item kTint{"Tint", "Factor of each channel"},
    kBrightness{"Brightness", "Added to all channels"}, kContrast{"Contrast", "Factor about the middle grey"},
    kWhite{"White point", "The value that becomes white"}, kOpacity{"Opacity", "Factor of the opacity"},
    kNeutral{"Reset colours", "Take back what these controls have changed"};

// Clean.
inline constexpr Item kCleanUp{
    "Clean up", "Shows floaters in red first, then removes them; a run's photos help to find them"},
    kPreview{"Preview", "Show in red what would be removed"}, kRemove{"Remove", "Delete these splats"},
    kCancel{"Cancel", "Keep them"};
inline constexpr Item kFloaters{"Floaters", "Groups of fewer than 10 splats that touch nothing else"},
    kContradicted{"Not in the photos", "Splats without which the scene is closer to the photos"},
    kFar{"Far clusters", "All but the largest group of splats that touch"},
    kFewViews{"Seen by fewer than", "Splats that fewer photos than this see"},
    kFaint{"Almost transparent", "Splats with an opacity below this"},
    kLarge{"Too large", "Splats with a larger standard deviation than this, world units"};
inline constexpr const char *kPart = "{} ({}{:.3g} %)", *kFinding = "looking ...",
                            *kComparing = "Comparing with photo {} of {}",
                            *kNothingFound = "nothing to remove";

inline constexpr const char *kRemoveFloaters = "Remove floaters", *kRemoveFar = "Remove far clusters",
                            *kRemoveContradicted = "Remove what is not in the photos",
                            *kRemoveFewViews = "Remove rarely seen splats",
                            *kRemoveFaint = "Remove almost transparent splats",
                            *kRemoveLarge = "Remove large splats";

// Histogram.
inline constexpr Item kColumn{"Values", "What is counted"};
inline constexpr Item kCounts[] = {{"Linear", "Heights are counts"},
                                   {"Log", "Heights are logarithms of counts"}};
inline constexpr const char *kDragRange = "drag a range to select it", *kCounting = "counting ...",
                            *kBin = "{:.4g} to {:.4g}: {} splats, {} selected";

// Scenes and history.
inline constexpr const char *kShowScene = "Show or hide", *kUnsaved = "has edits that are not saved",
                            *kCloseScene = "Close", *kCloseQuestion = "Close without saving its edits?",
                            *kDiscard = "Discard edits", *kCopied = "The command is copied.",
                            *kBeginning = "Opened", *kMemory = "{:.1f} MiB, last edit {:.0f} ms";
inline constexpr Item kAddScene{"Add a scene", "Open another file beside this one"};
inline constexpr Item kCopyCommand{"Copy as command",
                                   "The line of ewa convert that does the same to the file"};

}  // namespace edit_panel

// Help (F1).
struct HelpRow {
    std::string_view keys;
    const char* text;
};
/// The first of the keys.
constexpr std::string_view key_of(const Item& item) {
    const std::string_view keys = item.keys;
    return keys.substr(0, keys.find(" or "));
}
inline constexpr HelpRow kLookHelp[] = {
    {"left drag", "orbit the scene"},
    {"Ctrl + left drag", "look around"},
    {"right or middle drag", "move sideways"},
    {"wheel", "move closer or farther"},
    {"double click", "look at this point and orbit it"},
    {"W S  A D  Q E", "fly: forward, back; left, right; down, up"},
    {"Shift", "fly four times as fast"},
    {"F", "show the whole scene; in the tab Edit the selection"},
    {"T", "turntable"},
    {"U", "change the up axis"},
    {"- +", "make splats smaller, larger"},
    {"C", "show cameras; a click goes to one"},
    {"left right", "go to the previous, next camera"},
    {"V", "compare with the image: side by side, wipe, difference"},
    {"Ctrl + 1 to 9", "save this view under a number"},
    {"Shift + 1 to 9", "go to the saved view"},
};
inline constexpr HelpRow kViewHelp[] = {
    {"R", "return to the first view"},
    {"P", "parallel rays"},
    {"G", "go to the nearest camera"},
    {"M", "measure: click two points"},
    {"1 to 7", "colour, depth, opacity, splats per pixel, ellipsoids, median depth, normals"},
};
inline constexpr HelpRow kSelectHelp[] = {
    {"[ ]", "make the brush smaller, larger"},
    {"Enter", "select with the sphere or box; end the polygon"},
    {key_of(edit_panel::kAll), "select all"},
    {key_of(edit_panel::kNone), "select none"},
    {key_of(edit_panel::kInvert), "invert the selection"},
    {"Ctrl + +, Ctrl + -", "grow, shrink the selection"},
    {key_of(edit_panel::kLock), "lock the selection; with Shift: unlock all"},
    {key_of(edit_panel::kHide), "hide the selection; with Shift: show all"},
    {"Esc", "end what is being drawn, then the tool"},
};
inline constexpr HelpRow kChangeHelp[] = {
    {key_of(edit_panel::kDelete), "delete the selection"},
    {key_of(kUndo), "undo; Ctrl + Shift + Z: redo"},
};
inline constexpr HelpRow kFilmHelp[] = {
    {"K", "make this view a key of the film"},
    {"Space", "play or stop the film"},
    {"Ctrl + K", "save the film"},
};
inline constexpr HelpRow kFilesHelp[] = {
    {"drop a file", "open it; a dataset gives its cameras to splats"},
    {key_of(kOpenFile), "open a file; with Shift: a folder"},
    {key_of(kSave), "save; with Shift: to another file"},
    {key_of(kPicture), "screenshot (PNG); with Shift: EXR"},
    {"Tab", "go to the other tab of the panel"},
    {key_of(kHelp), "show or hide these keys"},
    {key_of(kPanel), "show or hide the panel"},
    {"Ctrl + Q", "quit"},
};
struct HelpGroup {
    const char* name;
    std::span<const HelpRow> rows;
    bool second = false;  // in the second column, where there are two
    Tool first = Tool::view,
         end = Tool::view;  // the tools before the rows: from the first to the one before the end
};
inline constexpr HelpGroup kHelpGroups[] = {
    {"Look", kLookHelp},
    {"Look, in the tab View", kViewHelp},
    {"Film", kFilmHelp},
    {"Select, in the tab Edit", kSelectHelp, true, Tool::rectangle, Tool::move},
    {"Change, in the tab Edit", kChangeHelp, true, Tool::move, Tool::origin},
    {"File", kFilesHelp, true},
};

// What the tools say over the picture.
inline constexpr const char *kNeedsPinhole =
                                "This tool needs a view without distortion. The view has changed to one.",
                            *kPolygonViewChanged = "The view has moved. Click the corners again.",
                            *kNoSurface = "No splat is opaque enough here.",
                            *kNoLevel = "The three points are nearly on a line. Click three others.",
                            *kLiveRefuses = "A training that runs takes selections, deletes and locks alone.",
                            *kLiveUndo = "The training has this edit already, and cannot take it back.",
                            *kNewerSplats =
                                "Newer splats of the run wait until your edits are saved or undone.",
                            *kNoGround = "No ground is found. Click three points of it.",
                            *kTrueLength = "True length",
                            *kPointsEdited = "Points of a dataset cannot be edited. Train first.",
                            *kShapeButtons[] = {"Select", "Add", "Remove",
                                                "Intersect"};  // as edit::Operation
inline constexpr const char *kPointOf = "Level: point {} of 3",
                            *kTurnedBy = "Level: turned by {:.1f} degrees";

// The dialogs of files.
namespace files {

inline constexpr const char *kSave = "Save", *kReplace = "Replace", *kCancel = "Cancel", *kOpen = "Open",
                            *kClose = "Close", *kBrowse = "Browse", *kPathHint = "folder/name",
                            *kFile = "File", *kOther = "Other",
                            *kWouldReplace = " exists and would be replaced.";

// Save as.
inline constexpr const char *kSaveAsTitle = "Save as", *kFormat = "Format", *kPurpose = "For",
                            *kSize = "Size", *kAbout = "about ", *kScopeActive = "The active scene",
                            *kScopeAll = "All shown scenes, joined", *kKeepsAll = "It keeps everything.",
                            *kStillSaving = "the last save is not done yet",
                            *kNothingToSave = "nothing is open";
inline constexpr const char *kLostViewDependence = "View-dependent colours (SH) are left out.",
                            *kLostWorld = "Positions are rounded to float32 far from the origin.",
                            *kLostDensity =
                                "Opacities of the kernel \"density\" are fitted to the usual kernel.",
                            *kLostBroken = "Splats with values that are not finite would be left out.";
inline constexpr const char *kOriginalStays =
                                "This file was opened. The original is never touched: choose another name.",
                            *kPartOfOriginal =
                                "The original has its values beside this name. The original "
                                "is never touched: choose another folder.",
                            *kIsAFolder = "This is a folder: add a name.";

// Unsaved edits, and those of a session that has crashed.
inline constexpr const char *kLeaveTitle = "Unsaved edits", *kDontSave = "Don't save",
                            *kUnsavedEdits = " has edits that are not saved.", *kSavingTitle = "Saving",
                            *kWriting = "Writing ", *kJournalTitle = "Edits of an earlier session",
                            *kJournalRestore = "Restore", *kJournalDiscard = "Discard",
                            *kJournalLater = "Later", *kEndedUnsaved = "ewa-view ended without saving ",
                            *kFinishing = "The last edits are being done ...";

// Publish.
inline constexpr const char* kPublish = "Publish";
inline constexpr const char *kPageName = "Web page (one HTML file)",
                            *kPageHint =
                                "Opens in any browser, without a network. A server needs this one "
                                "file.",
                            *kSogName = "SOG (small file)",
                            *kSogHint = "For SuperSplat, PlayCanvas, Spark and other viewers on the web.",
                            *kLevelsName = "Streamed levels (large scenes)",
                            *kLevelsHint =
                                "A folder for a web server. A viewer loads what it shows, coarse "
                                "splats first.";
inline constexpr const char *kTitle = "Title", *kWithViews = "With the views of the film",
                            *kLevels = "Levels", *kAsManyLevels = "as many as the scene needs",
                            *kPublishBusy = "The last edit is still being done.", *kStop = "Stop",
                            *kStopped = "Stopped.", *kFailed = "ewa convert has failed.", *kWrote = "Wrote ",
                            *kShowFolder = "Show folder", *kCopyPath = "Copy path", *kDetails = "Details";

// Open, where the desktop has no dialog.
inline constexpr const char *kOpenTitle = "Open a file or folder", *kNoSuchFile = "There is no such file.";

}  // namespace files

// The strip of the film, and its dialogs.
namespace film {

inline constexpr Item kPlay{"Play", "Space: shows the film in real time"}, kStop{"Stop", "Space: stops"},
    kAdd{"Add key", "K: this view becomes a key, at the playhead or after the last key"},
    kReplace{"Replace key", "The key under the playhead gets this view"},
    kDelete{"Delete key", "Deletes the key under the playhead"},
    kEven{"Space evenly", "All keys get the same distance in time"}, kSaveFilm{"Save film ...", "Ctrl + K"},
    kSaveKeys{"Save keys", "Writes the keys to a file, for ewa render --views and ewa convert --views"},
    kSavePicture{"Save picture ...", "A still of any size"},
    kHide{"\xc3\x97", "Hides this strip; the keys stay"};
inline constexpr const char *kSpeed = "Speed", *kLoop = "Loop", *kSmooth = "Smooth", *kLength = "Length",
                            *kDistance = "New key after",
                            *kEmpty = "K makes this view the first key of a film",
                            *kEnding = "ffmpeg ends the film", *kProgress = "%d of %d frames",
                            *kStopped = "the film was stopped", *kFramesStay = " of its frames are in ";
inline constexpr const char *kFilmTitle = "Save film", *kPictureTitle = "Save picture", *kPixels = "Pixels",
                            *kRate = "Frames a second", *kCodec = "Codec",
                            *kAsTheWindow = "As the window: ", *kFrames = "%d frames, %.1f s";
inline constexpr const char
    *kFilmNames =
        "A film ends in .mp4, .mov, .mkv or .webm. Another name is that of a folder of PNG pictures.",
    *kPictureNames = "A picture ends in .png, .jpg, .webp or .exr.", *kNoFfmpeg = "ffmpeg is not installed",
    *kPngFrames = ", so the frames become a folder of PNG pictures.";

}  // namespace film

}  // namespace ewa::viewer::texts
