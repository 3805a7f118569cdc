// SPDX-License-Identifier: Apache-2.0
// The sphere and the box that select: wire frames with handles in the scene.
#pragma once
#include "viewer/editor/tool_parts.h"

namespace ewa::viewer {

class ShapeHandles {
  public:
    explicit ShapeHandles(const ToolRoom& room) : room_(room) {}
    /// Puts the shape of the active tool at the selection, or before the view, unless it has a place in this scene.
    void place();
    /// Returns whether the left button was used.
    bool mouse(const ToolPicture& picture);
    /// The left button is up. Returns whether a drag has ended.
    bool release();
    /// Selects the splats inside.
    void select(edit::Operation operation) const;
    /// Draws the shape and its buttons.
    void draw(const ToolPicture& picture);
    /// Ends a drag, and gives the shape back its place before.
    bool cancel();

  private:
    struct Drag {
        size_t handle;
        SelectionShapes before;      // when the drag began, as the next ones
        glm::dvec3 grabbed, center;  // the point under the pointer; the middle
        double along = 0;            // of the point on the axis of a face
    };
    bool sphere() const { return room_.settings().tool == Tool::sphere; }
    glm::dvec3 middle() const;
    /// The middle; then the radius of a sphere, or the low and high face of the box on each axis.
    std::vector<glm::dvec3> handles(const Camera& camera) const;
    std::optional<size_t> handle_at(const ToolPicture& picture) const;
    void move(const ToolPicture& picture);
    std::vector<Segment> wires() const;
    void buttons(const ToolPicture& picture, const std::vector<Segment>& drawn) const;

    const ToolRoom& room_;
    std::optional<Drag> drag_;
    std::optional<std::filesystem::path> sphere_of_, box_of_;  // the scenes in which they have places
};

}  // namespace ewa::viewer
