// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/pick_tools.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "viewer/editor/texts.h"
#include "viewer/editor/theme.h"

namespace ewa::viewer {

void PickTools::click(const ToolPicture& picture) {
    asked_ = room_.settings().tool;
    operation_ = room_.operation();
    room_.shown.ask_point(picture.pointer, asked_ == Tool::eyedropper ? PointUse::color : PointUse::edit);
}

bool PickTools::take_point(const SurfacePoint& point) {
    if (asked_ == Tool::view || asked_ != room_.settings().tool) return false;
    if (!point.place) {
        room_.state.say(texts::kNoSurface);
    } else if (asked_ == Tool::flood) {
        room_.select(fmt::format("flood={},{:.4g}", point_text(*point.place), room_.settings().tolerance),
                     operation_);
    } else if (asked_ == Tool::eyedropper) {
        room_.select(fmt::format("color={:.4g},{:.4g},{:.4g},{:.4g}", point.color.r, point.color.g,
                                 point.color.b, room_.settings().tolerance),
                     operation_);
    } else if (asked_ == Tool::sphere) {
        room_.settings().sphere_center = *point.place;
    } else if (asked_ == Tool::level) {
        add_level_point(*point.place);
    } else if (asked_ == Tool::origin) {
        glm::dmat4 matrix(1.0);
        matrix[3] = glm::dvec4(-*point.place, 1);
        room_.transform("Set origin", "move=" + point_text(-*point.place), true);
        room_.move_view(matrix);
    }
    return true;
}

void PickTools::add_level_point(const glm::dvec3& point) {
    points_.push_back(point);
    if (points_.size() < 3) return;
    const std::array<glm::dvec3, 3> three{points_[0], points_[1], points_[2]};
    points_.clear();
    const auto matrix = level_matrix(three, towards_viewer(room_.shown.camera(), three[0]));
    if (!matrix) return room_.state.say(texts::kNoLevel);
    room_.transform("Level", matrix_text(*matrix), true);
    room_.move_view(*matrix);
    room_.navigation.view.set_up({0, -1, 0});
}

void PickTools::set_unit(double factor) const {
    if (!(factor > 0 && std::isfinite(factor)) || factor == 1) return;
    room_.transform("Set unit", fmt::format("scale={:.9g}", factor), true);
    room_.move_view(about(glm::dvec3(0), glm::dmat3(factor)));
    for (glm::dvec3& point : room_.shown.measurement.points) point *= factor;
}

/// Beside the label of the measurement.
void PickTools::length_field(const ToolPicture& picture) {
    const Measurement& measurement = room_.shown.measurement;
    if (!measurement.complete()) return;
    const double distance = measurement.distance();
    const auto middle = picture.pixel((measurement.points[0] + measurement.points[1]) / 2.0);
    if (!middle || !(distance > 0)) return;
    if (measured_ != distance) measured_ = length_ = distance;
    const float line = ImGui::GetTextLineHeight();
    const ImVec2 at = picture.gui(*middle);
    ImGui::SetNextWindowPos({at.x + line / 2, at.y + 1.5f * line});
    constexpr auto kFlags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize |
                            ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                            ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav;
    if (ImGui::Begin("length", nullptr, kFlags)) {
        ImGui::SetNextItemWidth(6 * line);
        if (ImGui::InputDouble(texts::kTrueLength, &length_, 0, 0, "%.6g",
                               ImGuiInputTextFlags_EnterReturnsTrue))
            set_unit(length_ / distance);
    }
    ImGui::End();
}

bool PickTools::remove_last() {
    if (points_.empty()) return false;
    points_.pop_back();
    return true;
}

bool PickTools::cancel() {
    const bool any = !points_.empty();
    points_.clear();
    asked_ = Tool::view;
    return any;
}

void PickTools::draw(const ToolPicture& picture) {
    if (room_.settings().tool == Tool::measure) return length_field(picture);
    const ToolPen pen(picture);
    for (size_t i = 0; i < points_.size(); ++i) {
        if (i > 0) pen.segment({points_[i - 1], points_[i]}, accent());
        if (const auto pixel = picture.pixel(points_[i])) pen.knob(*pixel, ToolPen::kLight);
    }
    if (points_.size() != 2) return;
    if (const auto last = picture.pixel(points_[1]), first = picture.pixel(points_[0]); last && first)
        pen.line({*last, picture.pointer, *first}, accent());
}

}  // namespace ewa::viewer
