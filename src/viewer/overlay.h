// SPDX-License-Identifier: Apache-2.0
// What is drawn over the picture besides the panel: cameras, the wipe's border, labels, the first hint. With
// Dear ImGui; changes nothing.
#pragma once
#include <optional>
#include <string>

#include "ewa/dataset.h"
#include "viewer/photo_comparison.h"

namespace ewa::viewer {

struct CamerasShown {
    const Dataset& dataset;
    const Camera& view;            // of the size of `place`
    Rectangle place;               // of the rendering in the window, px
    double size = 1;               // of a frustum, world units
    std::optional<int> stands_at;  // not drawn: it would frame the picture
};

/// Draws every camera's frustum, the one under the pointer with its name, and returns that one.
std::optional<int> draw_cameras(const CamerasShown& cameras);

/// Names over both pictures, and with a wipe their border at `wipe` of the photograph's width.
void draw_comparison(Comparison comparison, const Arrangement& arrangement, float wipe);
/// Whether the pointer is at the wipe's border.
bool over_wipe(const Rectangle& photograph, float wipe);

/// What has happened, above the hint.
void draw_note(const std::string& note);

/// What to begin with, at the window's lower border. photographs: there are some to compare with.
void draw_hint(bool photographs);

}  // namespace ewa::viewer
