// SPDX-License-Identifier: Apache-2.0
// What Dear ImGui draws over the image: the list of keys, cameras, labels, the border of a wipe, and messages. The
// functions change only their arguments.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "ewa/capture.h"
#include "viewer/file_dialog.h"
#include "viewer/layout.h"
#include "viewer/measurement.h"
#include "viewer/opening.h"

struct ImVec2;

namespace ewa::viewer {

/// Converts px of the framebuffer to ImGui's coordinates.
ImVec2 gui_point(double x, double y);

/// Begins a window with buttons, centred at a height of the area (px of the window) from 0 (top) to 1. ImGui::End() follows.
bool begin_card(const char* name, const Rectangle& area, float at);

/// The list of keys. A click outside closes it.
void draw_help(bool& open);

/// Draws the frustum of each camera of the scene's dataset but that of `at_camera`, whose own would frame the image. size: of a
/// frustum, world units. view: of the size of `place` (px of the window). Returns the frame whose camera is under the pointer, and shows its
/// name and support.
std::optional<int> draw_cameras(const OpenedScene& scene, const Camera& view, const Rectangle& place,
                                double size, std::optional<int> at_camera);

/// Marks the points that are measured, with their distance. view: of the size of `place`.
void draw_measurement(const Measurement& measurement, const Camera& view, const Rectangle& place);

/// Labels both images. A wipe also has a border, at the share `wipe` of the image's width.
void draw_comparison(Comparison comparison, const Arrangement& arrangement, float wipe);
/// Whether the pointer is at the border of the wipe.
bool over_wipe(const Rectangle& image, float wipe);

// The messages stay inside `area` (px of the window) and wrap.

/// A message, above the hint.
void draw_note(const std::string& note, const Rectangle& area);
/// The first keys to know, at the lower border.
struct Hint {
    bool images, panel,
        comparing;  // there are images to compare with; the panel is shown; images are compared
    float opacity;
};
void draw_hint(const Hint& hint, const Rectangle& area);
/// A line at the upper border that says what the picture shows.
void draw_banner(const std::string& text, const Rectangle& area);
/// One line in large letters in the middle of the window, and an explanation below it.
struct Headline {
    std::string text, explanation;
};
void draw_headline(const Headline& headline, const Rectangle& area);
/// What the user chose in an empty window: a dialog, or a file.
struct Welcome {
    std::optional<Wanted> wanted;
    std::optional<std::filesystem::path> file;
};
/// Draws the files that were opened last. Returns the one that is clicked.
std::optional<std::filesystem::path> draw_recent();
/// Draws the card of an empty window: what can be dropped, buttons, and the files that were opened last.
Welcome draw_welcome(const Rectangle& area);
/// Shows the progress of the search for cameras, and a button. Returns whether the button is clicked.
bool draw_search(const CaptureProgress& progress, const Rectangle& area);

}  // namespace ewa::viewer
