// SPDX-License-Identifier: Apache-2.0
// The tools, and the settings that they share with the panel.
#pragma once
#include <cstddef>
#include <glm/vec3.hpp>
#include <string>

#include "edit/shapes.h"

namespace ewa::viewer {

/// The tools of the toolbar. One is active at a time; `view` moves the camera alone.
enum class Tool {
    view,
    rectangle,
    lasso,
    polygon,
    brush,
    sphere,
    box,
    flood,
    eyedropper,
    move,
    rotate,
    scale,
    measure,
    level,
    origin
};

/// Whether a tool moves splats, which a training that runs does not take.
constexpr bool moves_splats(Tool tool) {
    return tool == Tool::move || tool == Tool::rotate || tool == Tool::scale || tool == Tool::level ||
           tool == Tool::origin;
}

/// The shapes that select, in the world.
struct SelectionShapes {
    glm::dvec3 box_low{-1}, box_high{1}, sphere_center{0};
    double sphere_radius = 1;
};
inline constexpr float kLeastBrush = 2, kMostBrush = 500;  // radius, px of the window

/// What the tools and the panel share: settings of selecting and of gizmos. The keys of docs/editor.md change them too.
struct EditSettings : SelectionShapes {
    Tool tool = Tool::view;
    std::string progress;  // of the tool, for the status line; empty: its hint
    bool live = false;     // edits go to a training, which takes selections, deletes and locks alone
    size_t sent = 0;       // steps that the training has
    edit::Operation operation = edit::Operation::set;  // Shift: add, Ctrl: remove, both: intersect
    bool front = false, extent = false;
    float brush = 40;         // radius, px of the window
    float tolerance = 0.15f;  // of flood and eyedropper, 0 to 1
    bool local = false;       // axes of gizmos
};

}  // namespace ewa::viewer
