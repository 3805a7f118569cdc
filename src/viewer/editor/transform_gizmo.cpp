// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/transform_gizmo.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <utility>

#include "viewer/editor/panel_sections.h"

namespace ewa::viewer {
namespace {

constexpr double kGizmoSize = 90;   // ToolPicture::unit
constexpr double kFreeRing = 1.18;  // radius of the ring about the view direction, in sizes
constexpr double kEdgeOn = 0.15;    // cosine below which a ring is dragged along its tangent
constexpr double kLeastFactor = 0.01;
constexpr double kAngleStep = std::numbers::pi / 12;
constexpr int kRingSides = 48;

bool snapping() {
    return ImGui::GetIO().KeyShift;
}

}  // namespace

std::optional<glm::dvec3> TransformGizmo::center() {
    const EditSnapshot& snapshot = room_.editor.snapshot();
    if (!snapshot.splats || snapshot.left == 0) return std::nullopt;
    if (awaited_ && (awaited_->version != snapshot.version || !room_.editor.busy())) awaited_.reset();
    return awaited_ ? awaited_->center : snapshot.middle;
}

double TransformGizmo::size(const ToolPicture& picture, const glm::dvec3& center) const {
    return kGizmoSize * picture.unit * world_per_pixel(picture.camera, center);
}

bool TransformGizmo::has(int handle) const {
    const bool plane = handle >= kPlaneX && handle <= kPlaneZ;
    return !plane || room_.settings().tool == Tool::move;
}

glm::dvec3 TransformGizmo::direction(const ToolPicture& picture, const glm::dvec3& center, int handle) const {
    return handle == kFree ? towards_viewer(picture.camera, center) : axes()[handle % 3];
}

std::vector<glm::dvec2> TransformGizmo::outline(const ToolPicture& picture, const glm::dvec3& center,
                                                int handle) const {
    const double length = size(picture, center);
    const glm::dvec3 axis = direction(picture, center, handle);
    const glm::dvec3 viewer = towards_viewer(picture.camera, center);
    const double facing = std::abs(glm::dot(axis, viewer));
    std::vector<glm::dvec3> points;
    if (room_.settings().tool == Tool::rotate) {
        // The half in front; of a ring that is seen from its axis, all of it.
        glm::dvec3 side = glm::cross(axis, viewer);
        if (facing > 0.99)
            side = glm::cross(axis, std::abs(axis.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0));
        side = glm::normalize(side);
        glm::dvec3 ahead = glm::cross(axis, side);
        if (glm::dot(ahead, viewer) < 0) ahead = -ahead;
        const double radius = length * (handle == kFree ? kFreeRing : 1);
        const double whole = std::numbers::pi * (facing > 0.95 ? 2 : 1);
        for (int i = 0; i <= kRingSides; ++i)
            points.push_back(center + radius * (std::cos(whole * i / kRingSides) * side +
                                                std::sin(whole * i / kRingSides) * ahead));
    } else if (handle == kFree) {
        points = {center};
    } else if (handle <= kZ) {
        if (facing < 0.98) points = {center + 0.2 * length * axis, center + length * axis};
    } else if (facing > kEdgeOn) {
        const glm::dvec3 u = axes()[(handle + 1) % 3] * length, v = axes()[(handle + 2) % 3] * length;
        points = {center + 0.35 * (u + v), center + 0.55 * u + 0.35 * v, center + 0.55 * (u + v),
                  center + 0.35 * u + 0.55 * v, center + 0.35 * (u + v)};
    }
    std::vector<glm::dvec2> line;
    for (const glm::dvec3& point : points) {
        const auto pixel = picture.pixel(point);
        if (!pixel) return {};
        line.push_back(*pixel);
    }
    return line;
}

std::optional<int> TransformGizmo::handle_at(const ToolPicture& picture, const glm::dvec3& center) const {
    if (drag_) return drag_->handle;
    if (!picture.free) return std::nullopt;
    std::optional<int> nearest;
    double least = kHandleReach * picture.unit;
    for (int handle = kFree; handle >= kX; --handle) {
        if (!has(handle)) continue;
        const double distance = distance_to_line(picture.pointer, outline(picture, center, handle));
        if (!(distance < least)) continue;
        least = distance;
        nearest = handle;
    }
    return nearest;
}

void TransformGizmo::begin(const ToolPicture& picture, const glm::dvec3& center, int handle) {
    const auto ray = picture.ray();
    // A selection that is being made must not be taken for none.
    if (!ray || (room_.editor.snapshot().selected == 0 && room_.editor.busy())) return;
    const double length = size(picture, center);
    Drag drag{handle, center, direction(picture, center, handle), axes(), length, picture.pointer, center};
    const bool on_axis = handle <= kZ && room_.settings().tool != Tool::rotate;
    if (on_axis) {
        drag.along = along_axis(*ray, center, drag.direction).value_or(length);
        if (std::abs(drag.along) < kLeastFactor * length) drag.along = length;
    } else if (room_.settings().tool == Tool::rotate &&
               std::abs(glm::dot(drag.direction, ray->direction)) < kEdgeOn) {
        drag.tangent = true;
        // The point of the ring that is nearest to the viewer.
        const glm::dvec3 viewer = towards_viewer(picture.camera, center);
        drag.grabbed =
            center + length * glm::normalize(viewer - drag.direction * glm::dot(viewer, drag.direction));
        const glm::dvec3 tangent = glm::cross(drag.direction, drag.grabbed - center) / length;
        drag.along = along_axis(*ray, drag.grabbed, tangent).value_or(0);
    } else {
        const auto point = on_plane(*ray, center, drag.direction);
        if (!point) return;
        drag.grabbed = *point;
    }
    drag_ = drag;
}

void TransformGizmo::move(const ToolRay& ray) {
    Drag& drag = *drag_;
    const double step = snapping() ? 0.1 * nice_unit(drag.size) : 0;
    glm::dvec3 moved(0);
    if (drag.handle <= kZ) {
        const auto along = along_axis(ray, drag.center, drag.direction);
        if (!along) return;
        const double way = snapped(*along - drag.along, step);
        moved = drag.direction * way;
        drag.label = fmt::format("{} {:+.4g}", "xyz"[drag.handle], way);
    } else {
        const auto point = on_plane(ray, drag.center, drag.direction);
        if (!point) return;
        glm::dvec3 parts = glm::transpose(drag.axes) * (*point - drag.grabbed);
        for (int axis = 0; axis < 3; ++axis) parts[axis] = snapped(parts[axis], step);
        moved = drag.axes * parts;
        drag.label = fmt::format("{:+.4g}, {:+.4g}, {:+.4g}", parts.x, parts.y, parts.z);
    }
    drag.matrix = glm::dmat4(1.0);
    drag.matrix[3] = glm::dvec4(moved, 1);
    drag.edit = "move=" + point_text(moved);
    room_.editor.drag(drag.matrix);
}

void TransformGizmo::rotate(const ToolRay& ray) {
    Drag& drag = *drag_;
    const glm::dvec3 arm = drag.grabbed - drag.center;
    double angle = 0;
    if (drag.tangent) {
        const double radius = glm::length(arm);
        const auto along = along_axis(ray, drag.grabbed, glm::cross(drag.direction, arm) / radius);
        if (!along || !(radius > 0)) return;
        angle = (*along - drag.along) / radius;
    } else {
        const auto point = on_plane(ray, drag.center, drag.direction);
        if (!point) return;
        angle = angle_about(drag.direction, arm, *point - drag.center);
    }
    angle = snapped(angle, snapping() ? kAngleStep : 0);
    drag.matrix = about(drag.center, turn_about(drag.direction, angle));
    drag.edit = matrix_text(drag.matrix);
    drag.label = fmt::format("{:.1f}\u00b0", angle * 180 / std::numbers::pi);
    room_.editor.drag(drag.matrix);
}

void TransformGizmo::scale(const ToolPicture& picture, const ToolRay& ray) {
    Drag& drag = *drag_;
    double factor = 1;
    if (drag.handle <= kZ) {
        const auto along = along_axis(ray, drag.center, drag.direction);
        if (!along) return;
        factor = *along / drag.along;
    } else {
        const glm::dvec2 way = picture.pointer - drag.pointer;
        factor = std::exp2((way.x - way.y) / (kGizmoSize * picture.unit));
    }
    factor = std::max(snapping() ? 0.1 : kLeastFactor, snapped(factor, snapping() ? 0.1 : 0));
    glm::dmat3 factors(factor);
    if (drag.handle <= kZ) {
        factors = glm::dmat3(1.0);
        factors[drag.handle][drag.handle] = factor;
    }
    drag.matrix = about(drag.center, drag.axes * factors * glm::transpose(drag.axes));
    drag.edit = matrix_text(drag.matrix);
    drag.label = fmt::format("\u00d7 {:.3g}", factor);
    room_.editor.drag(drag.matrix);
}

bool TransformGizmo::mouse(const ToolPicture& picture) {
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
        const auto at = center();
        const auto handle = at ? handle_at(picture, *at) : std::nullopt;
        if (handle) begin(picture, *at, *handle);
        return drag_.has_value();
    }
    if (!drag_) return false;
    const ImVec2 moved = ImGui::GetIO().MouseDelta;
    const auto ray = picture.ray();
    if (!ray || (moved.x == 0 && moved.y == 0)) return true;
    const Tool tool = room_.settings().tool;
    if (tool == Tool::move) move(*ray);
    if (tool == Tool::rotate) rotate(*ray);
    if (tool == Tool::scale) scale(picture, *ray);
    return true;
}

bool TransformGizmo::release() {
    if (!drag_) return false;
    const Drag drag = *std::exchange(drag_, std::nullopt);
    room_.editor.drag(std::nullopt);
    if (drag.matrix == glm::dmat4(1.0)) return true;
    const Tool tool = room_.settings().tool;
    if (tool == Tool::rotate) axes_ = glm::dmat3(drag.matrix) * axes();
    awaited_ = Awaited{room_.editor.snapshot().version, glm::dvec3(drag.matrix * glm::dvec4(drag.center, 1))};
    perform_on_selection(room_.editor,
                         tool == Tool::move     ? "Move"
                         : tool == Tool::rotate ? "Rotate"
                                                : "Scale",
                         {{"transform", drag.edit}});
    return true;
}

bool TransformGizmo::cancel() {
    if (!drag_) return false;
    drag_.reset();
    room_.editor.drag(std::nullopt);
    return true;
}

void TransformGizmo::draw(const ToolPicture& picture) {
    const auto still = center();
    if (!still) return;
    const glm::dvec3 at = drag_ ? glm::dvec3(drag_->matrix * glm::dvec4(drag_->center, 1)) : *still;
    const ToolPen pen(picture);
    const std::optional<int> pointed = handle_at(picture, *still);
    for (int handle = kX; handle <= kFree; ++handle) {
        const std::vector<glm::dvec2> line =
            has(handle) ? outline(picture, at, handle) : std::vector<glm::dvec2>();
        if (line.empty()) continue;
        const bool here = pointed == handle;
        const ImU32 color = handle < kFree ? axis_color(handle % 3, here)
                            : here         ? IM_COL32(255, 255, 160, 255)
                                           : ToolPen::kLight;
        const bool scales = room_.settings().tool == Tool::scale;
        if (line.size() > 1) pen.line(line, color, here ? 4 : 2.5);
        if (line.size() == 1 || (line.size() == 2 && scales)) pen.knob(line.back(), color, scales);
        if (line.size() == 2 && !scales) pen.tip(line[0], line[1], color);
    }
    if (drag_ && !drag_->label.empty()) pen.text(picture.pointer, drag_->label);
}

}  // namespace ewa::viewer
