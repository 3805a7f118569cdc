// SPDX-License-Identifier: Apache-2.0
// The sections that change values: Move and Colours.
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "viewer/editor/panel_controls.h"
#include "viewer/editor/panel_sections.h"

namespace ewa::viewer {
namespace {

constexpr float kLeastColourFactor = 0.01f;  // of colours: a factor of zero could not be taken back
constexpr int kIdleFrames = 3;               // after which an edit that has changed nothing has failed

/// Buttons of tools that change the whole scene.
void choose_scene_tool(EditSettings& settings) {
    std::vector<ui::Button> buttons;
    std::vector<Tool> tools;
    for (const texts::ToolText& text : texts::kTools) {
        if (text.tool != Tool::level && text.tool != Tool::measure && text.tool != Tool::origin) continue;
        tools.push_back(text.tool);
        buttons.push_back({{text.name, text.hint},
                           true,
                           text.tool == settings.tool ? ui::ButtonLook::chosen : ui::ButtonLook::plain});
    }
    if (const int clicked = ui::button_line(buttons); clicked >= 0) settings.tool = tools[size_t(clicked)];
}

/// As of the gizmo that does the same.
const char* title_of(const Placement& placement, const glm::dvec3& about) {
    const bool turns = placement.degrees != glm::dvec3(0), scales = placement.scale != 1;
    if (placement.position != about || turns == scales) return say::kMove.name;
    return turns ? say::kRotate : say::kScale.name;
}

}  // namespace

void MoveSection::draw(Editor& editor) {
    const EditSnapshot& now = editor.snapshot();
    if (version_ != now.version || scene_ != editor.active())
        placement_ = {.position = now.middle, .degrees = glm::dvec3(0), .scale = 1};
    version_ = now.version;
    scene_ = editor.active();
    ImGui::PushID("move");
    int axes = editor.settings.local ? 1 : 0;
    if (ui::segments(say::kAxes, axes)) editor.settings.local = axes == 1;
    ui::numbers(say::kPosition, placement_.position);
    bool apply = ui::entered();
    ui::numbers(say::kTurn, placement_.degrees);
    apply = ui::entered() || apply;
    ui::number(say::kScale, placement_.scale);
    apply = ui::entered() || apply;
    const auto finite = [](const glm::dvec3& v) { return std::isfinite(v.x + v.y + v.z); };
    // A selection that is being made must not be taken for none.
    const bool clear = now.selected > 0 || !editor.busy();
    const bool valid = clear && placement_.scale > 0 && std::isfinite(placement_.scale) &&
                       finite(placement_.position) && finite(placement_.degrees);
    const std::string text = valid ? placement_text(now.middle, placement_) : "";
    apply = ui::button_line({{say::kApply, !text.empty()}}) == 0 || apply;
    if (apply && !text.empty())
        perform_on_selection(editor, title_of(placement_, now.middle), {{"transform", text}});
    ImGui::TextWrapped("%s", say::kWholeSceneTools);
    choose_scene_tool(editor.settings);
    ImGui::PopID();
}

const edit::Adjustment& ColourSection::in_effect(const Editor& editor) {
    const EditSnapshot& now = editor.snapshot();
    const size_t done = std::min(now.done, now.steps.size());
    bool same = scene_ == editor.active() && done >= from_ && done - from_ < applied_.size();
    for (size_t i = from_; same && i < done; ++i) same = now.steps[i].title == say::kColours.name;
    if (!same) {
        scene_ = editor.active();
        from_ = done;
        applied_.assign(1, {});
    }
    return applied_[done - from_];
}

/// Takes over what the editor has done, and asks for what the controls have changed.
void ColourSection::settle(Editor& editor) {
    const EditSnapshot& now = editor.snapshot();
    const edit::Adjustment current = in_effect(editor);
    if (sent_ && (now.version != sent_version_ || (!editor.busy() && ++idle_frames_ > kIdleFrames))) {
        if (shown_ == *sent_) shown_ = current;
        sent_.reset();
        last_ = current;
    }
    if (sent_) return;
    if (current != last_) shown_ = last_ = current;  // an undo, or another selection
    for (float* factor : {&shown_.tint[0], &shown_.tint[1], &shown_.tint[2], &shown_.opacity})
        *factor = std::max(*factor, kLeastColourFactor);
    if (shown_ == current || editor.busy() || ImGui::IsAnyItemActive()) return;
    auto edits = adjustment_edits(current, shown_);
    if (edits.empty()) {  // a difference too small for a float32 factor
        shown_ = current;
        return;
    }
    sent_ = shown_;
    sent_version_ = now.version;
    idle_frames_ = 0;
    applied_.resize(std::min(now.done, now.steps.size()) - from_ + 1);
    applied_.push_back(shown_);
    perform_on_selection(editor, say::kColours.name, std::move(edits));
}

void ColourSection::draw(Editor& editor) {
    ImGui::PushID("colours");
    settle(editor);
    if (editor.snapshot().selected > 0) ImGui::TextDisabled("%s", say::kPlainColours);
    ui::label_left(say::kTint);
    ImGui::ColorEdit3("##tint", shown_.tint.data(), ImGuiColorEditFlags_Float);
    ui::slider(say::kBrightness, shown_.brightness, -0.5f, 0.5f, "%.3f");
    ui::slider(say::kContrast, shown_.contrast, 0.2f, 3, "%.2f", true);
    ui::slider(say::kWhite, shown_.white, 0.2f, 3, "%.2f", true);
    ui::slider(say::kOpacity, shown_.opacity, kLeastColourFactor, 2, "%.2f");
    if (ui::button_line({{say::kNeutral, shown_ != edit::Adjustment()}}) == 0) shown_ = {};
    ImGui::PopID();
}

}  // namespace ewa::viewer
