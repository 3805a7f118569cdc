// SPDX-License-Identifier: Apache-2.0
// The panel over the picture, and the list of keys. Draws with Dear ImGui; changes only what it is given.
#pragma once
#include <optional>
#include <string>

#include "ewa/dataset.h"
#include "viewer/render_thread.h"
#include "viewer/window.h"

namespace ewa::viewer {

/// What the panel shows.
struct PanelFacts {
    std::string file, device;
    size_t splats = 0;
    int scene_sh_degree = 0;           // highest that changes the picture
    const Dataset* dataset = nullptr;  // null: no cameras
    const FinishedPicture* picture = nullptr;
    bool drawing = false;  // a better picture is on its way
    std::string note;      // of the last screenshot, or what failed
    glm::dvec3 up{0};
};

/// What the user did in it.
struct PanelActions {
    bool screenshot = false, reset = false;
    std::optional<int> frame;
    std::optional<glm::dvec3> up;
};

PanelActions draw_panel(const PanelFacts& facts, Look& look, int& frame);
void draw_help(bool& open);

}  // namespace ewa::viewer
