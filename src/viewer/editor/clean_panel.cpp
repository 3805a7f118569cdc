// SPDX-License-Identifier: Apache-2.0
#include <imgui.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "viewer/editor/panel_controls.h"
#include "viewer/editor/panel_sections.h"

namespace ewa::viewer {
namespace {

constexpr const char *kFloatersShape = "floaters", *kContradictedShape = "contradicted";
constexpr double kLargeFactor = 20;  // of the median: the first limit of large splats
constexpr size_t kScaleSamples = 10'000;

/// A scale that few splats exceed.
float large_scale(const Gaussians& splats) {
    std::vector<float> scales;
    for (size_t i = 0; i < splats.size(); i += 1 + splats.size() / kScaleSamples)
        scales.push_back(
            std::max({splats.log_scales[3 * i], splats.log_scales[3 * i + 1], splats.log_scales[3 * i + 2]}));
    std::erase_if(scales, [](float scale) { return !std::isfinite(scale); });
    if (scales.empty()) return 1;
    const auto middle = scales.begin() + std::ptrdiff_t(scales.size() / 2);
    std::nth_element(scales.begin(), middle, scales.end());
    return float(kLargeFactor * std::exp(double(*middle)));
}

std::string finding_text(const Editor& editor) {
    const Comparing& now = *editor.comparing();
    const size_t photo = now.photo;
    return photo == 0 ? say::kFinding : fmt::format(say::kComparing, photo, now.photos.load());
}

}  // namespace

void CleanSection::end(Editor& editor) {
    if (previewed_.empty()) return;
    previewed_.clear();
    rule_ = {};
    editor.preview({});
}

void CleanSection::preview(Editor& editor, const std::vector<std::string>& shapes) {
    previewed_ = shapes;
    editor.preview(shapes);
}

/// A preview stays until the splats are gone.
void CleanSection::remove(Editor& editor, const char* title, const std::vector<std::string>& shapes) {
    edit::Step step{title, {}};
    for (const std::string& shape : shapes) step.edits.push_back({"remove", shape});
    editor.perform(step);
}

/// The buttons of a rule. first: one that shows what it takes, and perhaps one that removes it at once. title: of the step.
void CleanSection::draw_rule(Editor& editor, const ui::Text& text, std::initializer_list<ui::Button> first,
                             const char* title, const std::vector<std::string>& shapes) {
    ImGui::PushID(text.name);
    if (rule_ != text.name) {
        const int clicked = ui::button_line(first);
        if (clicked == 0) {
            rule_ = text.name;
            preview(editor, shapes);
        }
        if (clicked == 1) remove(editor, title, shapes);
        return ImGui::PopID();
    }
    // A number is dragged: the preview follows when it rests.
    if (shapes != previewed_ && !ImGui::IsAnyItemActive()) preview(editor, shapes);
    const auto count = editor.preview_count();
    const std::string remove_text =
        !count        ? finding_text(editor)
        : *count == 0 ? say::kNothingFound
                      : fmt::format("{} {}", say::kRemove.name, part_text(*count, editor.snapshot().left));
    const bool found = count.value_or(0) > 0 && !editor.busy();
    const auto look = found ? ui::ButtonLook::danger : ui::ButtonLook::plain;
    const int clicked = ui::button_line({{{remove_text.c_str()}, found, look}, {say::kCancel}});
    if (clicked == 0) remove(editor, title, shapes);
    if (clicked == 1) end(editor);
    ImGui::PopID();
}

void CleanSection::draw(Editor& editor) {
    const EditSnapshot& now = editor.snapshot();
    if (version_ != now.version || scene_ != editor.active()) end(editor);
    if (scene_ != editor.active()) scale_ = 0;
    version_ = now.version;
    scene_ = editor.active();
    if (scale_ == 0) scale_ = large_scale(*now.splats);
    ImGui::PushID("clean");
    waiting_ = editor.busy();
    if (rule_.empty() && editor.comparing()->photo > 0) {  // for an edit
        ImGui::TextDisabled("%s", finding_text(editor).c_str());
        if (ui::button_line({{say::kCancel}}) == 0) editor.preview({});
    }
    const std::initializer_list<ui::Button> first{{say::kPreview}, {say::kRemove}};
    // By their groups, then by the photos.
    std::vector<std::string> floaters{kFloatersShape};
    if (now.cameras.contradicted) floaters.emplace_back(kContradictedShape);
    draw_rule(editor, say::kCleanUp, {{say::kCleanUp, true, ui::ButtonLook::chosen}}, say::kRemoveFloaters,
              floaters);
    ui::label_left(say::kFloaters);
    draw_rule(editor, say::kFloaters, first, say::kRemoveFloaters, {kFloatersShape});
    if (now.cameras.contradicted) {
        ui::label_left(say::kContradicted);
        draw_rule(editor, say::kContradicted, first, say::kRemoveContradicted, {kContradictedShape});
    }
    ui::label_left(say::kFar);
    draw_rule(editor, say::kFar, first, say::kRemoveFar, {"far"});
    if (now.cameras) {
        ui::label_left(say::kFewViews);
        ImGui::SliderInt("##views", &views_, 1, 20, "%d", ImGuiSliderFlags_AlwaysClamp);
        draw_rule(editor, say::kFewViews, first, say::kRemoveFewViews,
                  {fmt::format("{}=..{}", edit::kViews, views_ - 1)});
    }
    ui::slider(say::kFaint, opacity_, 0.001f, 1, "%.3f", true);
    draw_rule(editor, say::kFaint, first, say::kRemoveFaint, {fmt::format("opacity=..{}", opacity_)});
    ui::label_left(say::kLarge);
    float scale = scale_;
    if (ImGui::InputFloat("##scale", &scale, 0, 0, "%.4g") && scale > 0 && std::isfinite(scale))
        scale_ = scale;
    draw_rule(editor, say::kLarge, first, say::kRemoveLarge, {fmt::format("scale={}..", scale_)});
    ImGui::PopID();
}

}  // namespace ewa::viewer
