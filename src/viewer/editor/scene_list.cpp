// SPDX-License-Identifier: Apache-2.0
// The lists of the panel of edits: scenes and history.
#include <imgui.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "core/text.h"
#include "viewer/editor/icons.h"
#include "viewer/editor/modal.h"
#include "viewer/editor/panel_controls.h"
#include "viewer/editor/panel_sections.h"
#include "viewer/editor/theme.h"

namespace ewa::viewer {
namespace {

constexpr size_t kMostRows = 10;          // of the history, without scrolling
constexpr size_t kMostHintLetters = 300;  // of a step's words
constexpr size_t kHintLetters = 32;       // of a line of them

/// Returns whether the scene is to be closed.
bool close_button(bool unsaved, bool enabled) {
    bool close = false;
    ImGui::BeginDisabled(!enabled);
    if (ImGui::Button("x", ImVec2(ImGui::GetFrameHeight(), 0))) {
        close = !unsaved;
        if (unsaved) ImGui::OpenPopup("question");
    }
    ImGui::EndDisabled();
    ui::show_hint(say::kCloseScene);
    if (ImGui::BeginPopup("question")) {
        ImGui::TextUnformatted(say::kCloseQuestion);
        const Choice choice = draw_choices(say::kDiscard, nullptr, say::kCancel.name);
        close = choice == Choice::confirm;
        if (choice != Choice::none) ImGui::CloseCurrentPopup();
        ImGui::EndPopup();
    }
    return close;
}

std::string words_of(const edit::Step& step) {
    std::string text;
    for (const edit::Words& words : step.edits) {
        text += (text.empty() ? "--" : " --") + words.name;
        if (!words.value.empty()) text += " " + words.value;
        if (text.size() > kMostHintLetters) return core::one_line(text.substr(0, kMostHintLetters)) + " ...";
    }
    return core::one_line(text);
}

/// The row after `done` steps.
void history_row(Editor& editor, size_t done) {
    const EditSnapshot& now = editor.snapshot();
    const bool undone = done > now.done;
    ImGui::PushID(int(done));
    ImGui::PushStyleColor(ImGuiCol_Text,
                          ImGui::GetStyleColorVec4(undone ? ImGuiCol_TextDisabled : ImGuiCol_Text));
    const std::string title = done == 0 ? say::kBeginning : core::one_line(now.steps[done - 1].title);
    const bool clicked = ImGui::Selectable("##step", done == now.done);
    if (done > 0 && ImGui::IsItemHovered()) {
        const std::string words = broken_lines(words_of(now.steps[done - 1]), kHintLetters);
        ui::show_hint((title + "\n" + words).c_str());
    }
    ImGui::SameLine();
    ImGui::TextUnformatted(title.c_str());
    ImGui::PopStyleColor();
    ImGui::PopID();
    if (!clicked) return;
    const size_t from = now.done;
    for (size_t i = done; i < from; ++i) editor.undo();
    for (size_t i = from; i < done; ++i) editor.redo();
}

}  // namespace

void draw_scenes(Editor& editor) {
    ImGui::PushID("scenes");
    std::optional<size_t> closed;
    size_t shown = 0;
    for (size_t i = 0; i < editor.scenes(); ++i) shown += editor.scene(i).shown;
    for (size_t i = 0; i < editor.scenes(); ++i) {
        const EditedScene& scene = editor.scene(i);
        const float side = ImGui::GetFrameHeight(), gap = ImGui::GetStyle().ItemSpacing.x;
        ImGui::PushID(int(i));
        const Icon eye = scene.shown ? Icon::eye : Icon::eye_off;
        const bool free = !scene.shown || shown > 1;
        if (icon_button(eye, say::kShowScene, false, free, side)) editor.show(i, !scene.shown);
        ImGui::SameLine();
        ImGui::PushStyleVar(ImGuiStyleVar_SelectableTextAlign, ImVec2(0, 0.5f));
        const float width = std::max(side, ImGui::GetContentRegionAvail().x - 2 * (side + gap));
        const std::string label = core::one_line(scene.name) + "###name";
        if (ImGui::Selectable(label.c_str(), i == editor.active(), 0, ImVec2(width, side)))
            editor.activate(i);
        ImGui::PopStyleVar();
        ImGui::SameLine();
        ImGui::Dummy(ImVec2(side, side));
        const ImVec2 dot = ImGui::GetItemRectMin();
        if (scene.unsaved) {
            ImGui::GetWindowDrawList()->AddCircleFilled(ImVec2(dot.x + 0.5f * side, dot.y + 0.5f * side),
                                                        0.16f * side, ImU32(accent()));
            ui::show_hint(say::kUnsaved);
        }
        ImGui::SameLine();
        if (close_button(scene.unsaved, editor.scenes() > 1)) closed = i;
        ImGui::PopID();
    }
    if (ui::button_line({{say::kAddScene}}) == 0) editor.wants_scene = true;
    ImGui::PopID();
    if (closed) editor.close(*closed);
}

void draw_history(Editor& editor) {
    const EditSnapshot& now = editor.snapshot();
    ImGui::PushID("history");
    const size_t rows = now.steps.size() + 1;
    const float height = float(std::min(rows, kMostRows)) * ImGui::GetTextLineHeightWithSpacing();
    if (ImGui::BeginChild("steps", ImVec2(0, height))) {
        ImGuiListClipper clipper;
        clipper.Begin(int(rows));  // the newest step first
        while (clipper.Step())
            for (int row = clipper.DisplayStart; row < clipper.DisplayEnd; ++row)
                history_row(editor, rows - 1 - size_t(row));
    }
    ImGui::EndChild();
    if (ui::button_line({{say::kCopyCommand, now.done > 0}}) == 0) {
        ImGui::SetClipboardText(editor.command().c_str());
        editor.say(say::kCopied);
    }
    ImGui::TextDisabled(
        "%s", fmt::format(say::kMemory, double(now.history_bytes) / (1 << 20), now.milliseconds).c_str());
    ImGui::PopID();
}

}  // namespace ewa::viewer
