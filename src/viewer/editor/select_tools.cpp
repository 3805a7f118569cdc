// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/select_tools.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "viewer/editor/texts.h"
#include "viewer/editor/theme.h"

namespace ewa::viewer {
namespace {

constexpr double kPickPx = 3;           // side of the rectangle of a click
constexpr double kLineTolerance = 0.5;  // of drawn lines, ToolPicture::unit
constexpr const char* kOperationSigns[] = {"", "+", "-", "&"};

bool same_picture(const Camera& a, const Camera& b) {
    return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy &&
           a.rotation == b.rotation && a.translation == b.translation && a.distortion == b.distortion;
}

}  // namespace

void SelectTools::press(const ToolPicture& picture) {
    if (!room_.image_shapes_work()) return;
    if (room_.settings().tool != Tool::polygon) {
        dragging_ = true;
        points_ = {picture.pointer};
        return;
    }
    if (!points_.empty() && !same_picture(camera_, picture.camera)) {
        points_.clear();
        room_.say(texts::kPolygonViewChanged);
    }
    const bool closes =
        points_.size() >= 3 && glm::length(picture.pointer - points_[0]) < kHandleReach * picture.unit;
    if (closes || ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) return end_polygon();
    if (points_.empty()) camera_ = picture.camera;
    points_.push_back(picture.pointer);
}

void SelectTools::mouse(const ToolPicture& picture) {
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) return press(picture);
    if (dragging_ && glm::length(picture.pointer - points_.back()) >= picture.unit) {
        if (room_.settings().tool == Tool::rectangle) points_.resize(1);
        points_.push_back(picture.pointer);
    }
}

void SelectTools::release(const ToolPicture& picture) {
    if (!std::exchange(dragging_, false)) return;
    points_.push_back(picture.pointer);
    const Camera& camera = picture.camera;
    std::vector<glm::dvec2> line = simplified(std::exchange(points_, {}), kLineTolerance * picture.unit);
    if (line.front() == line.back()) line.pop_back();
    const edit::Operation operation = room_.operation();
    EditSettings& settings = room_.settings();
    if (settings.tool == Tool::rectangle && tool_clicked()) {
        const glm::dvec2 half(kPickPx / 2 * picture.unit);
        const bool front = std::exchange(settings.front, true);
        room_.select(edit::rectangle_shape(camera, picture.pointer - half, picture.pointer + half),
                     operation);
        settings.front = front;
    } else if (settings.tool == Tool::rectangle) {
        room_.select(edit::rectangle_shape(camera, glm::min(line.front(), line.back()),
                                           glm::max(line.front(), line.back())),
                     operation);
    } else if (settings.tool == Tool::lasso && line.size() >= 3) {
        room_.select(edit::polygon_shape(camera, line), operation);
    } else if (settings.tool == Tool::brush) {
        room_.select(edit::brush_shape(camera, brush_px(picture), line), operation);
    }
}

void SelectTools::end_polygon() {
    if (points_.size() < 3) return;
    const std::vector<glm::dvec2> corners = std::exchange(points_, {});
    if (same_picture(camera_, room_.shown.camera()))
        room_.select(edit::polygon_shape(camera_, corners), room_.operation());
    else
        room_.say(texts::kPolygonViewChanged);
}

bool SelectTools::key(const KeyPress& press) {
    if (room_.settings().tool != Tool::polygon || points_.empty()) return false;
    if (press.key == GLFW_KEY_ENTER || press.key == GLFW_KEY_KP_ENTER) {
        end_polygon();
        return true;
    }
    if (press.key != GLFW_KEY_BACKSPACE) return false;
    points_.pop_back();
    return true;
}

bool SelectTools::cancel() {
    const bool any = dragging_ || !points_.empty();
    dragging_ = false;
    points_.clear();
    return any;
}

void SelectTools::change_brush(double steps) {
    float& brush = room_.settings().brush;
    brush = std::clamp(float(double(brush) * std::pow(1.15, steps)), kLeastBrush, kMostBrush);
}

void SelectTools::draw(const ToolPicture& picture) const {
    const ToolPen pen(picture);
    const Tool tool = room_.settings().tool;
    if (picture.free && (ImGui::GetIO().KeyShift || ImGui::GetIO().KeyCtrl))
        pen.text(picture.pointer, kOperationSigns[size_t(room_.operation())]);
    if (tool == Tool::brush) {
        const double step = 2 * picture.scale.y;
        for (const StrokeSpan& span :
             stroke_spans(simplified(points_, kLineTolerance * picture.unit), brush_px(picture), step))
            pen.fill({span.low, span.y - step / 2}, {span.high, span.y + step / 2}, accent(0.35f));
        if (picture.free || dragging_) pen.circle(picture.pointer, brush_px(picture));
    } else if (tool == Tool::rectangle && points_.size() >= 2) {
        const glm::dvec2 a = points_.front(), b = points_.back();
        pen.fill(glm::min(a, b), glm::max(a, b), accent(0.15f));
        pen.line({a, {b.x, a.y}, b, {a.x, b.y}, a});
    } else if (tool == Tool::lasso && points_.size() >= 2) {
        std::vector<glm::dvec2> closed = points_;
        closed.push_back(points_.front());
        pen.line(closed);
    } else if (tool == Tool::polygon && !points_.empty()) {
        std::vector<glm::dvec2> corners = points_;
        corners.push_back(picture.pointer);
        pen.line(corners);
        if (points_.size() >= 2) pen.line({picture.pointer, points_.front()}, accent(0.6f), 1);
        for (size_t i = 0; i < points_.size(); ++i) pen.knob(points_[i], i == 0 ? accent() : ToolPen::kLight);
    }
}

}  // namespace ewa::viewer
