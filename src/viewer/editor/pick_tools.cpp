// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/pick_tools.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <glm/trigonometric.hpp>
#include <utility>

#include "edit/edits.h"
#include "edit/ground.h"
#include "viewer/editor/texts.h"
#include "viewer/editor/theme.h"

namespace ewa::viewer {
namespace {

constexpr double kLeastOpacity = 0.1;  // of flooded splats

}  // namespace

void PickTools::click(const ToolPicture& picture) {
    asked_ = room_.settings().tool;
    operation_ = room_.operation();
    room_.shown.ask_point(picture.pointer, asked_ == Tool::eyedropper ? PointUse::color : PointUse::edit);
}

bool PickTools::take_point(const SurfacePoint& point) {
    if (asked_ == Tool::view || asked_ != room_.settings().tool) return false;
    if (!point.place) {
        room_.say(texts::kNoSurface);
    } else if (asked_ == Tool::flood) {
        room_.select(fmt::format("flood={},{:.4g},{:.4g}", point_text(*point.place),
                                 room_.settings().tolerance, kLeastOpacity),
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
        move_all("Set origin", "move=" + point_text(-*point.place));
    }
    return true;
}

/// Moves every splat. The view follows with the edit.
void PickTools::move_all(const char* title, const std::string& step) const {
    room_.perform(title, "transform", std::string(edit::kAllSplats) + step);
}

void PickTools::add_level_point(const glm::dvec3& point) {
    points_.push_back(point);
    if (points_.size() < 3) return say_points();
    const std::array<glm::dvec3, 3> three{points_[0], points_[1], points_[2]};
    points_.clear();
    level(level_matrix(three, towards_viewer(room_.shown.camera(), three[0])), texts::kNoLevel);
}

void PickTools::find_ground() {
    const EditSnapshot& now = room_.editor.snapshot();
    points_.clear();
    if (now.splats)
        level(edit::level_ground(*now.splats, *now.states, room_.navigation.view.up()), texts::kNoGround);
}

void PickTools::level(const std::optional<glm::dmat4>& matrix, const char* problem) {
    std::string& progress = room_.settings().progress;
    progress.clear();
    if (!matrix) return room_.say(problem);
    const double cosine = ((*matrix)[0][0] + (*matrix)[1][1] + (*matrix)[2][2] - 1) / 2;
    progress = fmt::format(texts::kTurnedBy, glm::degrees(std::acos(std::clamp(cosine, -1.0, 1.0))));
    move_all("Level", matrix_text(*matrix));
}

void PickTools::say_points() const {
    room_.settings().progress =
        points_.empty() ? std::string() : fmt::format(texts::kPointOf, points_.size() + 1);
}

void PickTools::set_unit(double factor) const {
    if (!(factor > 0 && std::isfinite(factor)) || factor == 1) return;
    move_all("Set unit", fmt::format("scale={:.9g}", factor));
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
        ImGui::AlignTextToFramePadding();
        ImGui::TextUnformatted(texts::kTrueLength);
        ImGui::SameLine();
        ImGui::SetNextItemWidth(6 * line);
        if (ImGui::InputDouble("##length", &length_, 0, 0, "%.4g", ImGuiInputTextFlags_EnterReturnsTrue))
            set_unit(length_ / distance);
    }
    ImGui::End();
}

bool PickTools::remove_last() {
    if (points_.empty()) return false;
    points_.pop_back();
    say_points();
    return true;
}

bool PickTools::cancel() {
    const bool any = !points_.empty();
    points_.clear();
    room_.settings().progress.clear();
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
