// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/tool_parts.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "viewer/editor/texts.h"

namespace ewa::viewer {
namespace {

constexpr ImU32 kRim = IM_COL32(0, 0, 0, 220), kLabelBack = IM_COL32(0, 0, 0, 190);
constexpr double kOutside = 100000;  // px; positions are clamped to this

}  // namespace

edit::Operation held_operation(const EditSettings& settings) {
    const ImGuiIO& io = ImGui::GetIO();
    if (io.KeyShift && io.KeyCtrl) return edit::Operation::intersect;
    if (io.KeyShift) return edit::Operation::add;
    return io.KeyCtrl ? edit::Operation::remove : settings.operation;
}

void ToolRoom::select(const std::string& shape, edit::Operation operation) const {
    editor.select(shape, operation);
}

void ToolRoom::perform(const char* title, const char* name, const std::string& value) const {
    editor.perform({title, {{name, value}}});
}

void ToolRoom::move_view(const glm::dmat4& matrix) const {
    ViewCamera& view = navigation.view;
    const Size size = state.picture_area().size();
    const auto moved = [&](const glm::dvec3& point) { return glm::dvec3(matrix * glm::dvec4(point, 1)); };
    const double scale = std::cbrt(glm::determinant(glm::dmat3(matrix)));
    view.stand({carried(view.camera(size.width, size.height), matrix), moved(view.pivot()), view.up(),
                view.radius() * scale});
    navigation.leave_camera();
    state.redraw(Loop::kRedraws);
}

bool ToolRoom::image_shapes_work() const {
    const Camera camera = shown.camera();
    if (camera.distortion.none() || camera.distortion.lens == Lens::orthographic) return true;
    say(texts::kNeedsPinhole);
    ViewCamera& view = navigation.view;
    view.stand({scene::pinhole_at(camera), view.pivot(), view.up(), view.radius()});
    navigation.leave_camera();
    state.redraw(Loop::kRedraws);
    return false;
}

ToolPicture::ToolPicture(const Shown& shown) : camera(shown.camera()), place(shown.arrangement().rendering) {
    const ImGuiIO& io = ImGui::GetIO();
    scale = {std::max(1e-3, double(io.DisplayFramebufferScale.x)),
             std::max(1e-3, double(io.DisplayFramebufferScale.y))};
    unit = double(ImGui::GetTextLineHeight()) / kTextHeight * scale.x;
    pointer = glm::dvec2(io.MousePos.x, io.MousePos.y) * scale - glm::dvec2(place.x, place.y);
    inside = pointer.x >= 0 && pointer.y >= 0 && pointer.x < place.width && pointer.y < place.height;
    free = inside && !io.WantCaptureMouse;
}

ImVec2 ToolPicture::gui(const glm::dvec2& pixel) const {
    const auto coordinate = [](double px, int origin, double per_unit) {
        return float((std::clamp(px, -kOutside, kOutside) + origin) / per_unit);
    };
    return {coordinate(pixel.x, place.x, scale.x), coordinate(pixel.y, place.y, scale.y)};
}

ToolPen::ToolPen(const ToolPicture& picture)
    : picture_(picture),
      list_(*ImGui::GetBackgroundDrawList()),
      unit_(float(picture.unit / picture.scale.x)) {
    list_.PushClipRect(picture.gui({0, 0}), picture.gui({picture.place.width, picture.place.height}));
}

ToolPen::~ToolPen() {
    list_.PopClipRect();
}

void ToolPen::line(const std::vector<glm::dvec2>& points, ImU32 color, double width) const {
    std::vector<ImVec2> path;
    path.reserve(points.size());
    for (const glm::dvec2& point : points) path.push_back(picture_.gui(point));
    const int count = int(path.size());
    list_.AddPolyline(path.data(), count, kRim, ImDrawFlags_None, float(width + 3) * unit_);
    list_.AddPolyline(path.data(), count, color, ImDrawFlags_None, float(width) * unit_);
}

void ToolPen::segment(const Segment& segment, ImU32 color, double width) const {
    if (const auto ends = projected(segment, picture_.camera)) line({(*ends)[0], (*ends)[1]}, color, width);
}

void ToolPen::circle(const glm::dvec2& center, double radius_px, ImU32 color) const {
    const float radius = float(radius_px / picture_.scale.x);
    list_.AddCircle(picture_.gui(center), radius, kRim, 0, 4.5f * unit_);
    list_.AddCircle(picture_.gui(center), radius, color, 0, 1.5f * unit_);
}

void ToolPen::knob(const glm::dvec2& center, ImU32 color, bool square) const {
    const ImVec2 at = picture_.gui(center);
    for (const auto& [size, shade] : {std::pair(6.5f * unit_, kRim), std::pair(5 * unit_, color)}) {
        if (square)
            list_.AddRectFilled({at.x - size, at.y - size}, {at.x + size, at.y + size}, shade, unit_);
        else
            list_.AddCircleFilled(at, size, shade);
    }
}

void ToolPen::tip(const glm::dvec2& from, const glm::dvec2& to, ImU32 color) const {
    const double length = glm::length(to - from);
    if (!(length > 0)) return;
    const glm::dvec2 way = (to - from) * (picture_.unit / length), side(-way.y, way.x);
    for (const auto& [size, shade] : {std::pair(9.0, kRim), std::pair(7.0, color)})
        list_.AddTriangleFilled(picture_.gui(to + way * (1.3 * size)),
                                picture_.gui(to - way * 2.0 + side * size * 0.8),
                                picture_.gui(to - way * 2.0 - side * size * 0.8), shade);
}

void ToolPen::fill(const glm::dvec2& low, const glm::dvec2& high, ImU32 color) const {
    list_.AddRectFilled(picture_.gui(low), picture_.gui(high), color);
}

void ToolPen::text(const glm::dvec2& at, const std::string& words) const {
    ImVec2 low = picture_.gui(at);
    low = {low.x + 16 * unit_, low.y + 12 * unit_};
    const ImVec2 size = ImGui::CalcTextSize(words.c_str());
    const float rim = 4 * unit_;
    list_.AddRectFilled({low.x - rim, low.y - rim / 2}, {low.x + size.x + rim, low.y + size.y + rim / 2},
                        kLabelBack, rim);
    list_.AddText(low, kLight, words.c_str());
}

bool tool_clicked() {
    return ImGui::IsMouseReleased(ImGuiMouseButton_Left) &&
           ImGui::GetIO().MouseDragMaxDistanceSqr[ImGuiMouseButton_Left] < kStillPixels * kStillPixels;
}

ImU32 axis_color(int axis, bool pointed) {
    constexpr std::array kQuiet{IM_COL32(222, 92, 84, 255), IM_COL32(110, 186, 96, 255),
                                IM_COL32(86, 140, 232, 255)};
    constexpr std::array kBright{IM_COL32(255, 150, 142, 255), IM_COL32(166, 240, 150, 255),
                                 IM_COL32(150, 192, 255, 255)};
    return (pointed ? kBright : kQuiet)[size_t(axis)];
}

}  // namespace ewa::viewer
