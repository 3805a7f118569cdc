// SPDX-License-Identifier: Apache-2.0
// What the tools of the editor share: the window's parts, the picture under the pointer, and a pen for lines over it.
#pragma once
#include <imgui.h>

#include <string>
#include <vector>

#include "scene/framing.h"
#include "scene/frustum.h"
#include "viewer/editor/editor.h"
#include "viewer/editor/gizmo.h"
#include "viewer/navigation.h"
#include "viewer/shown.h"

namespace ewa::viewer {

/// The operation of the held keys; without them, that of the settings.
edit::Operation held_operation(const EditSettings& settings);

struct ToolRoom {
    ViewState& state;
    Navigation& navigation;
    Shown& shown;
    Editor& editor;

    EditSettings& settings() const { return editor.settings; }
    edit::Operation operation() const { return held_operation(editor.settings); }
    void select(const std::string& shape, edit::Operation operation) const;
    /// Performs a step of one edit.
    void perform(const char* title, const char* name, const std::string& value = "") const;
    /// A message that the next edit removes.
    void say(const std::string& text) const { state.say(text, true); }
    /// Moves the view with the splats. matrix: rotation, translation and one scale.
    void move_view(const glm::dmat4& matrix) const;
    /// Whether shapes in the image can select in this view. If not, says so and changes to a pinhole.
    bool image_shapes_work() const;
};

/// The picture and the pointer in this frame of ImGui. Positions are in px of the picture.
struct ToolPicture {
    explicit ToolPicture(const Shown& shown);
    std::optional<ToolRay> ray() const { return ray_through(camera, pointer); }
    std::optional<glm::dvec2> pixel(const glm::dvec3& point) const { return projected(point, camera); }
    ImVec2 gui(const glm::dvec2& pixel) const;  // in ImGui's coordinates

    Camera camera;
    Rectangle place;
    glm::dvec2 scale;                   // px per unit of ImGui
    double unit = 1;                    // px that are one px at a text scale of 1
    glm::dvec2 pointer;                 // px
    bool inside = false, free = false;  // the pointer is in the picture; no item of ImGui has it
};

/// Draws lines with a dark rim over the picture, and behind the windows of ImGui. Widths are in ToolPicture::unit.
class ToolPen {
  public:
    explicit ToolPen(const ToolPicture& picture);
    ~ToolPen();
    ToolPen(const ToolPen&) = delete;
    ToolPen& operator=(const ToolPen&) = delete;

    static constexpr ImU32 kLight = IM_COL32(255, 255, 255, 240);
    void line(const std::vector<glm::dvec2>& points, ImU32 color = kLight, double width = 1.5) const;
    void segment(const Segment& segment, ImU32 color = kLight, double width = 1.5) const;
    void circle(const glm::dvec2& center, double radius_px, ImU32 color = kLight) const;
    void knob(const glm::dvec2& center, ImU32 color, bool square = false) const;  // a handle
    void tip(const glm::dvec2& from, const glm::dvec2& to, ImU32 color) const;    // of an arrow
    void fill(const glm::dvec2& low, const glm::dvec2& high, ImU32 color) const;
    void text(const glm::dvec2& at, const std::string& words) const;  // right of and below a point

  private:
    const ToolPicture& picture_;
    ImDrawList& list_;
    float unit_;  // in ImGui's coordinates
};

/// Within this distance (ToolPicture::unit) the pointer is on a handle.
inline constexpr double kHandleReach = 9;
/// Whether the left button went up without a drag.
bool tool_clicked();

/// The colour of axis 0, 1 or 2; brighter under the pointer.
ImU32 axis_color(int axis, bool pointed);

}  // namespace ewa::viewer
