// SPDX-License-Identifier: Apache-2.0
// The tools that act on a clicked point: flood, eyedropper, the centre of the sphere, level, origin, and the unit of a measurement.
#pragma once
#include "viewer/editor/tool_parts.h"

namespace ewa::viewer {

class PickTools {
  public:
    explicit PickTools(const ToolRoom& room) : room_(room) {}
    /// A click with the active tool.
    void click(const ToolPicture& picture);
    bool take_point(const SurfacePoint& point);
    /// Removes the last of the clicked points. Returns whether there was one.
    bool remove_last();
    /// Levels the scene by the ground that is found.
    void find_ground();
    /// Draws the clicked points, and the field for the true length of a measurement.
    void draw(const ToolPicture& picture);
    bool cancel();

  private:
    void add_level_point(const glm::dvec3& point);
    void level(const std::optional<glm::dmat4>& matrix, const char* problem);
    void say_points() const;
    void move_all(const char* title, const std::string& step) const;
    void set_unit(double factor) const;
    void length_field(const ToolPicture& picture);

    const ToolRoom& room_;
    Tool asked_ = Tool::view;  // the tool that has asked for a point; view: none waits
    edit::Operation operation_ = edit::Operation::set;  // of that click
    std::vector<glm::dvec3> points_;                    // of the ground
    double measured_ = 0, length_ = 0;                  // the last measurement; what is typed
};

}  // namespace ewa::viewer
