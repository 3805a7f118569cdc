// SPDX-License-Identifier: Apache-2.0
// What is drawn over the image besides the panel: cameras, labels, the border of a wipe, notes. Uses Dear
// ImGui and changes no state.
#pragma once
#include <optional>
#include <string>

#include "ewa/dataset.h"
#include "viewer/comparison.h"

namespace ewa::viewer {

struct CamerasShown {
    const Dataset& dataset;
    const Camera& view;            // of the size of `place`
    Rectangle place;               // of the render in the window, px
    double size = 1;               // of a frustum, world units
    std::optional<int> at_camera;  // this one is not drawn: it would frame the image
};

/// Draws the frustum of each camera. Returns the one under the pointer, which also shows its name.
std::optional<int> draw_cameras(const CamerasShown& cameras);

/// Labels both images. A wipe also has a border, at the share `wipe` of the image's width.
void draw_comparison(Comparison comparison, const Arrangement& arrangement, float wipe);
/// Whether the pointer is at the border of the wipe.
bool over_wipe(const Rectangle& image, float wipe);

/// A message, above the hint.
void draw_note(const std::string& note);

/// The first keys to know, at the lower border. images: there are images to compare with.
void draw_hint(bool images);

}  // namespace ewa::viewer
