// SPDX-License-Identifier: Apache-2.0
// The handles that move, rotate and scale the selection, or all splats without one.
#pragma once
#include "viewer/editor/tool_parts.h"

namespace ewa::viewer {

class TransformGizmo {
  public:
    explicit TransformGizmo(const ToolRoom& room) : room_(room) {}
    /// Returns whether the left button was used.
    bool mouse(const ToolPicture& picture);
    /// The left button is up: performs the edit. Returns whether a drag has ended.
    bool release();
    void draw(const ToolPicture& picture);
    bool cancel();

  private:
    enum Handle { kX, kY, kZ, kPlaneX, kPlaneY, kPlaneZ, kFree };  // a plane is named after its normal
    struct Drag {
        int handle;
        glm::dvec3 center, direction;  // direction: of the axis, or the normal of the plane
        glm::dmat3 axes;
        double size;                        // of the handles, world units
        glm::dvec2 pointer;                 // when it began
        glm::dvec3 grabbed;                 // the point of the handle there
        double along = 0;                   // of it on the axis
        glm::dmat4 matrix{1.0};             // what the drag does
        bool tangent = false;               // a ring that is seen edge-on: the drag follows its tangent
        std::string edit = {}, label = {};  // as --transform has it; for people
    };
    /// Where the handles are. Empty without splats.
    std::optional<glm::dvec3> center();
    glm::dmat3 axes() const { return room_.settings().local ? axes_ : glm::dmat3(1.0); }
    bool has(int handle) const;
    /// The handle as a line in px; a point for those in the middle. Empty: it cannot be seen or used.
    std::vector<glm::dvec2> outline(const ToolPicture& picture, const glm::dvec3& center, int handle) const;
    std::optional<int> handle_at(const ToolPicture& picture, const glm::dvec3& center) const;
    glm::dvec3 direction(const ToolPicture& picture, const glm::dvec3& center, int handle) const;
    double size(const ToolPicture& picture, const glm::dvec3& center) const;
    void begin(const ToolPicture& picture, const glm::dvec3& center, int handle);
    void move(const ToolRay& ray);
    void rotate(const ToolRay& ray);
    void scale(const ToolPicture& picture, const ToolRay& ray);

    const ToolRoom& room_;
    std::optional<Drag> drag_;
    glm::dmat3 axes_{1.0};  // of the last rotation
    /// The edit that was performed last, until the snapshot has it.
    struct Awaited {
        uint64_t version;
        glm::dvec3 center;
    };
    std::optional<Awaited> awaited_;
};

}  // namespace ewa::viewer
