// SPDX-License-Identifier: Apache-2.0
// The tools that select by a shape in the image: rectangle, lasso, polygon and brush.
#pragma once
#include "viewer/editor/tool_parts.h"

namespace ewa::viewer {

class SelectTools {
  public:
    explicit SelectTools(const ToolRoom& room) : room_(room) {}
    /// Takes the left button while it is down.
    void mouse(const ToolPicture& picture);
    /// The left button is up: a drag ends.
    void release(const ToolPicture& picture);
    bool key(const KeyPress& press);
    void draw(const ToolPicture& picture) const;
    /// Returns whether a selection was in progress.
    bool cancel();
    /// Makes the brush larger; negative steps make it smaller.
    void change_brush(double steps);

  private:
    void press(const ToolPicture& picture);
    void end_polygon();
    double brush_px(const ToolPicture& picture) const {
        return double(room_.settings().brush) * picture.scale.x;
    }

    const ToolRoom& room_;
    bool dragging_ = false;
    std::vector<glm::dvec2> points_;  // px of the picture
    Camera camera_;                   // of the polygon's first corner
};

}  // namespace ewa::viewer
