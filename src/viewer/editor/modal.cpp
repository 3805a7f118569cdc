// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/modal.h"

#include <imgui.h>

#include <algorithm>

#include "core/folders.h"
#include "core/text.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

constexpr const char *kBrowse = "Browse", *kPathHint = "folder/name",
                     *kWouldReplace = " exists and would be replaced.";
constexpr float kModalWidth = 34, kModalMargin = 2;           // heights of the text
constexpr const char* kModalId = "###modal";                  // of all of them: one is open at a time
constexpr ImU32 kWarningColor = IM_COL32(232, 140, 40, 255);  // on dark and on light

bool modal_key(ImGuiKey key) {
#if IMGUI_VERSION_NUM < 18700
    return ImGui::IsKeyPressed(ImGui::GetKeyIndex(key), false);
#else
    return ImGui::IsKeyPressed(key, false);
#endif
}

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

Choice draw_choices(const char* confirm, const char* other, const char* cancel, bool enabled) {
    Choice choice = Choice::none, focused = Choice::confirm;
    const auto button = [&](const char* text, Choice meaning) {
        if (!text) return;
        if (meaning != Choice::confirm && (confirm || other)) ImGui::SameLine();
        if (ImGui::Button(text)) choice = meaning;
        if (ImGui::IsItemFocused()) focused = meaning;
    };
    ImGui::Spacing();
    ImGui::BeginDisabled(!enabled);
    button(confirm, Choice::confirm);
    ImGui::EndDisabled();
    button(other, Choice::other);
    button(cancel, Choice::cancel);
    if (confirm && (modal_key(ImGuiKey_Enter) || modal_key(ImGuiKey_KeyPadEnter))) choice = focused;
    if (modal_key(ImGuiKey_Escape)) choice = Choice::cancel;
    return choice == Choice::confirm && !enabled ? Choice::none : choice;
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
    complain(exists && !warned ? core::one_line(out.string()) + kWouldReplace : refusal);
    replaces_ = exists;
    return problem_.empty();
}

void PathField::complain(const std::string& problem) {
    problem_ = problem;
    judged_ = path();
    replaces_ = false;
}

void PathField::draw(FileDialog& files) {
    if (path() != judged_) complain({});
    const ImGuiStyle& style = ImGui::GetStyle();
    const float button = ImGui::CalcTextSize(kBrowse).x + 2 * style.FramePadding.x + style.ItemSpacing.x;
    if (ImGui::IsWindowAppearing()) ImGui::SetKeyboardFocusHere();
    ImGui::SetNextItemWidth(std::max(1.0f, modal_width() - button));
    ImGui::InputTextWithHint("##path", kPathHint, text_.data(), text_.size(),
                             ImGuiInputTextFlags_AutoSelectAll);
    ImGui::SameLine();
    const bool browse = ImGui::Button(kBrowse);
    if (!problem_.empty()) modal_text(problem_, true);
    if (!browse || files.open()) return;
    fs::path proposed = path();
    std::error_code error;
    // A dialog begins in a folder that exists. A new folder becomes the name.
    while (proposed.has_parent_path() && proposed.has_relative_path() &&
           !fs::is_directory(proposed.parent_path(), error))
        proposed = proposed.parent_path();
    files.ask(Wanted::save, proposed);
    asked_ = true;
}

bool PathField::take(FileDialog& files) {
    if (!asked_) return false;
    try {
        if (const auto chosen = files.take()) set(*chosen);
    } catch (const std::exception& error) {
        complain(core::one_line(error.what()));
    }
    asked_ = files.open();
    return !asked_;
}

}  // namespace ewa::viewer
