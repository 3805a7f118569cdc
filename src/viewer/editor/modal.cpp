// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/modal.h"

#include <imgui.h>

#include <algorithm>
#include <cfloat>
#include <utility>

#include "core/folders.h"
#include "core/text.h"
#include "viewer/editor/texts.h"
#include "viewer/editor/theme.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

constexpr float kModalWidth = 44, kModalMargin = 2;           // heights of the text
constexpr int kProblemLines = 2;                              // that a path has room for
constexpr const char* kModalId = "###modal";                  // of all of them: one is open at a time
constexpr ImU32 kWarningColor = IM_COL32(232, 140, 40, 255);  // on dark and on light

Choice pressed_key = Choice::none;  // since the last frame
bool list_open = false;             // in the last frame; it has the keys then

}  // namespace

float modal_width() {
    const float line = ImGui::GetTextLineHeight();
    return std::max(line,
                    std::min(kModalWidth * line, ImGui::GetIO().DisplaySize.x - 2 * kModalMargin * line));
}

bool begin_modal(const char* title) {
    if (!ImGui::IsPopupOpen(kModalId)) ImGui::OpenPopup(kModalId);
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos(ImVec2(size.x / 2, size.y / 2), ImGuiCond_Always, ImVec2(0.5f, 0.5f));
    ImGui::SetNextWindowSizeConstraints(ImVec2(0, 0), size);
    constexpr auto kFlags =
        ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings;
    if (!ImGui::BeginPopupModal((std::string(title) + kModalId).c_str(), nullptr, kFlags)) return false;
    ImGui::PushTextWrapPos(ImGui::GetCursorPosX() + modal_width());
    ImGui::Dummy(ImVec2(modal_width(), 0));
    return true;
}

void end_modal(bool stays) {
    ImGui::PopTextWrapPos();
    if (!stays) ImGui::CloseCurrentPopup();
    ImGui::EndPopup();
}

void close_modal() {
    if (!ImGui::IsPopupOpen(kModalId) || !ImGui::BeginPopupModal(kModalId)) return;
    ImGui::CloseCurrentPopup();
    ImGui::EndPopup();
}

void modal_text(const std::string& text, bool warning) {
    if (warning) ImGui::PushStyleColor(ImGuiCol_Text, kWarningColor);
    ImGui::TextUnformatted(text.c_str());
    if (warning) ImGui::PopStyleColor();
}

void modal_box(const char* name, const std::string& text, int lines) {
    const ImVec2 size(modal_width(), float(lines) * ImGui::GetTextLineHeightWithSpacing());
    if (ImGui::BeginChild(name, size)) {
        ImGui::PushTextWrapPos(0);
        ImGui::TextUnformatted(text.c_str());
        ImGui::PopTextWrapPos();
    }
    ImGui::EndChild();
}

bool modal_radio(const char* name, bool chosen) {
    ImGui::PushStyleVar(ImGuiStyleVar_FrameBorderSize, 1);
    ImGui::PushStyleColor(ImGuiCol_Border, ImGui::GetColorU32(ImGuiCol_TextDisabled));
    const bool clicked = ImGui::RadioButton(name, chosen);
    ImGui::PopStyleColor();
    ImGui::PopStyleVar();
    return clicked;
}

bool accent_button(const char* text, float width) {
    ImGui::PushStyleColor(ImGuiCol_Button, accent());
    ImGui::PushStyleColor(ImGuiCol_ButtonHovered, accent(0.9f));
    ImGui::PushStyleColor(ImGuiCol_ButtonActive, accent(0.75f));
    ImGui::PushStyleColor(ImGuiCol_Text, on_accent());
    const bool clicked = ImGui::Button(text, ImVec2(width, 0));
    ImGui::PopStyleColor(4);
    return clicked;
}

void reserve(float top, float height) {
    const float rest = top + height - ImGui::GetCursorPosY() - ImGui::GetStyle().ItemSpacing.y;
    if (rest > 0) ImGui::Dummy(ImVec2(0, rest));
}

bool begin_form(PathField& file, FileDialog* files) {
    if (!ImGui::BeginTable("form", 2, ImGuiTableFlags_None, ImVec2(modal_width(), 0))) return false;
    ImGui::TableSetupColumn("label", ImGuiTableColumnFlags_WidthFixed);
    ImGui::TableSetupColumn("field", ImGuiTableColumnFlags_WidthStretch);
    form_row(texts::files::kFile);
    file.draw(files);
    return true;
}

void form_row(const char* label) {
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(label);
    ImGui::TableNextColumn();
    ImGui::SetNextItemWidth(-FLT_MIN);
}

bool form_list(const char* label, std::span<const std::string> names, int& chosen) {
    form_row(label);
    const int before = chosen;
    ImGui::PushID(label);
    if (ImGui::BeginCombo("##list", chosen < 0 ? texts::files::kOther : names[size_t(chosen)].c_str())) {
        for (int i = 0; i < int(names.size()); ++i)
            if (ImGui::Selectable(names[size_t(i)].c_str(), i == chosen)) chosen = i;
        ImGui::EndCombo();
    }
    ImGui::PopID();
    return chosen != before;
}

void end_form() {
    ImGui::EndTable();
}

Choice draw_choices(const char* confirm, const char* other, const char* cancel, bool enabled) {
    Choice choice = Choice::none, focused = Choice::confirm;
    const ImGuiStyle& style = ImGui::GetStyle();
    float room = modal_width() + style.ItemSpacing.x;
    for (const char* text : {confirm, other, cancel})
        if (text) room -= ImGui::CalcTextSize(text).x + 2 * style.FramePadding.x + style.ItemSpacing.x;
    const auto button = [&](const char* text, Choice meaning) {
        if (!text) return;
        if (meaning != Choice::confirm && (confirm || (other && meaning != Choice::other))) ImGui::SameLine();
        if (meaning == Choice::confirm ? accent_button(text) : ImGui::Button(text)) choice = meaning;
        if (ImGui::IsItemFocused()) focused = meaning;
    };
    ImGui::Spacing();
    ImGui::SetCursorPosX(ImGui::GetCursorPosX() + std::max(0.0f, room));
    ImGui::BeginDisabled(!enabled);
    button(confirm, Choice::confirm);
    ImGui::EndDisabled();
    button(other, Choice::other);
    button(cancel, Choice::cancel);
    const Choice key = std::exchange(pressed_key, Choice::none);
    const bool in_list = std::exchange(list_open, ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopupId));
    if (key == Choice::confirm && confirm && !in_list) choice = focused;
    if (key == Choice::cancel && !in_list) choice = Choice::cancel;
    return choice == Choice::confirm && !enabled ? Choice::none : choice;
}

void press_modal(Choice key) {
    pressed_key = key;
}

void PathField::set(const fs::path& path) {
    const std::string text = path.string();
    const size_t count = std::min(text.size(), text_.size() - 1);
    std::copy_n(text.begin(), count, text_.begin());
    text_[count] = 0;
}

fs::path PathField::path() const {
    return core::with_home(std::string(core::trim(text_.data())));
}

bool PathField::accept(const fs::path& out, const std::string& refusal) {
    const bool warned = replaces_ && judged_ == out;
    set(out);
    const bool exists = refusal.empty() && core::is_file(out);
    complain(exists && !warned ? core::one_line(out.string()) + texts::files::kWouldReplace : refusal);
    replaces_ = exists;
    return problem_.empty();
}

void PathField::complain(const std::string& problem) {
    problem_ = problem;
    judged_ = path();
    replaces_ = false;
    focus_ = !problem.empty();
}

void PathField::draw(FileDialog* files) {
    if (path() != judged_) complain({});
    const ImGuiStyle& style = ImGui::GetStyle();
    const char* browse = texts::files::kBrowse;
    const float button = ImGui::CalcTextSize(browse).x + 2 * style.FramePadding.x + style.ItemSpacing.x;
    if (std::exchange(focus_, false) || ImGui::IsWindowAppearing()) ImGui::SetKeyboardFocusHere();
    const float room = ImGui::GetContentRegionAvail().x - (files ? button : 0);
    ImGui::SetNextItemWidth(std::max(1.0f, room));
    ImGui::InputTextWithHint("##path", texts::files::kPathHint, text_.data(), text_.size(),
                             ImGuiInputTextFlags_AutoSelectAll);
    if (files) ImGui::SameLine();
    const bool asks = files && ImGui::Button(browse);
    const float top = ImGui::GetCursorPosY();
    if (!problem_.empty()) modal_text(problem_, true);
    reserve(top, kProblemLines * ImGui::GetTextLineHeightWithSpacing());
    if (!asks || files->open()) return;
    fs::path proposed = path();
    std::error_code error;
    // A dialog begins in a folder that exists. A new folder becomes the name.
    while (proposed.has_parent_path() && proposed.has_relative_path() &&
           !fs::is_directory(proposed.parent_path(), error))
        proposed = proposed.parent_path();
    files->ask(Wanted::save, proposed);
    asked_ = true;
}

void PathField::take(FileDialog& files) {
    if (!asked_) return;
    try {
        if (const auto chosen = files.take()) set(*chosen);
    } catch (const std::exception& error) {
        complain(core::one_line(error.what()));
    }
    asked_ = files.open();
}

}  // namespace ewa::viewer
