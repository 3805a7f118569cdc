// SPDX-License-Identifier: Apache-2.0
#include <imgui.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "core/text.h"
#include "viewer/editor/panel_controls.h"
#include "viewer/editor/panel_sections.h"
#include "viewer/editor/tool_parts.h"

namespace ewa::viewer {
namespace {

constexpr double kFirstDistance = 0.01;  // of the selection's diagonal

void enclose(EditSettings& settings, const std::array<glm::dvec3, 2>& bounds) {
    settings.box_low = bounds[0];
    settings.box_high = bounds[1];
    settings.sphere_center = 0.5 * (bounds[0] + bounds[1]);
    settings.sphere_radius = std::max(1e-9, 0.5 * glm::distance(bounds[0], bounds[1]));
}

/// Buttons of edits without a shape.
void edit_line(Editor& editor, std::initializer_list<ui::Button> buttons) {
    const int clicked = ui::button_line(buttons);
    if (clicked < 0) return;
    const ui::Text& text = (buttons.begin() + clicked)->text;
    editor.perform({*text.value ? "" : text.name, {{text.edit, text.value}}});
}

void change_states(Editor& editor) {
    const EditSnapshot& now = editor.snapshot();
    const bool any = now.selected > 0;
    if (editor.settings.live) {
        edit_line(editor, {{say::kDelete, any, ui::ButtonLook::danger}, {say::kFreeze, any}});
        edit_line(editor, {{say::kUnfreeze, now.locked > 0}});
        return;
    }
    edit_line(editor, {{say::kLock, any}, {say::kUnlock, now.locked > 0}});
    edit_line(editor, {{say::kHide, any}, {say::kShow, now.hidden > 0}});
    edit_line(editor, {{say::kDelete, any, ui::ButtonLook::danger}, {say::kDuplicate, any}});
    const int clicked = ui::button_line({{say::kSeparate, any}, {say::kReset, any}});
    if (clicked == 0) editor.separate();
    if (clicked == 1) editor.perform({say::kReset.name, {{say::kReset.edit, ""}}});
}

}  // namespace

void SelectionSection::draw(Editor& editor) {
    EditSettings& settings = editor.settings;
    ImGui::PushID("selection");
    const EditSnapshot& now = editor.snapshot();
    // Always two lines, so that the buttons below stay where they are.
    using core::grouped;
    ImGui::Text("%s", fmt::format(say::kSelectedOf, grouped(now.selected), grouped(now.left)).c_str());
    ImGui::TextDisabled("%s",
                        fmt::format(say::kLockedAndHidden, grouped(now.locked), grouped(now.hidden)).c_str());
    edit_line(editor, {{say::kAll}, {say::kNone, now.selected > 0}, {say::kInvert}});
    int operation = int(settings.operation);
    if (ui::segments(say::kOperations, operation)) settings.operation = edit::Operation(operation);
    ui::checkbox(say::kFront, settings.front);
    ImGui::SameLine();
    ui::checkbox(say::kExtent, settings.extent);
    ui::slider(say::kBrush, settings.brush, kLeastBrush, kMostBrush, "%.0f px", true);
    ui::slider(say::kTolerance, settings.tolerance, 0, 1, "%.2f");
    draw_shape(editor);
    draw_growth(editor);
    change_states(editor);
    ImGui::PopID();
}

/// The numbers of the box or the sphere, while its tool is active.
void SelectionSection::draw_shape(Editor& editor) {
    EditSettings& settings = editor.settings;
    const EditSnapshot& now = editor.snapshot();
    const bool box = settings.tool == Tool::box;
    if (!box && settings.tool != Tool::sphere) return;
    if (box) {
        ui::numbers(say::kBoxLow, settings.box_low);
        if (ImGui::IsItemDeactivatedAfterEdit())
            settings.box_high = glm::max(settings.box_low, settings.box_high);
        ui::numbers(say::kBoxHigh, settings.box_high);
        if (ImGui::IsItemDeactivatedAfterEdit())
            settings.box_low = glm::min(settings.box_low, settings.box_high);
    } else {
        ui::numbers(say::kCentre, settings.sphere_center);
        double radius = settings.sphere_radius;
        if (ui::number(say::kRadius, radius) && radius > 0) settings.sphere_radius = radius;
    }
    const auto shape = [&] {
        return box ? edit::box_shape(settings.box_low, settings.box_high)
                   : edit::sphere_shape(settings.sphere_center, settings.sphere_radius);
    };
    ImGui::PushID("shape");
    const int around = ui::button_line(
        {{say::kWholeScene, now.bounds_of_all.has_value()}, {say::kAroundSelection, now.bounds.has_value()}});
    if (around >= 0) enclose(settings, around == 0 ? *now.bounds_of_all : *now.bounds);
    const int clicked = ui::button_line(
        {{say::kCopy}, {say::kPaste}, {say::kSelect}, {say::kCrop, true, ui::ButtonLook::danger}});
    const char* pasted = clicked == 1 ? ImGui::GetClipboardText() : nullptr;
    if (clicked == 0) ImGui::SetClipboardText(shape().c_str());
    if (pasted) paste_shape(pasted, settings);
    if (clicked == 2) editor.select(shape(), held_operation(settings));
    if (clicked == 3)
        editor.perform({say::kCrop.name, {{"select", shape()}, {"select", "invert"}, {"delete", ""}}});
    ImGui::PopID();
}

void SelectionSection::draw_growth(Editor& editor) {
    const EditSnapshot& now = editor.snapshot();
    if (distance_ == 0 && now.bounds) {
        const double size = kFirstDistance * glm::distance((*now.bounds)[0], (*now.bounds)[1]);
        if (size > 0) distance_ = std::pow(10.0, std::round(std::log10(size)));
    }
    ui::number(say::kDistance, distance_);
    const bool possible = now.selected > 0 && distance_ > 0 && std::isfinite(distance_);
    const std::string value = fmt::format("{:.9g}", distance_);
    const int clicked = ui::button_line({{say::kGrow, possible}, {say::kShrink, possible}});
    if (clicked >= 0) editor.perform({"", {{"select", (clicked == 0 ? "grow=" : "shrink=") + value}}});
}

}  // namespace ewa::viewer
