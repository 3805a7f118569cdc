// SPDX-License-Identifier: Apache-2.0
// The first things that a user sees: the card of an empty window, and the list of keys.
#include <imgui.h>

#include <algorithm>
#include <string>
#include <vector>

#include "core/text.h"
#include "viewer/editor/dialogs.h"
#include "viewer/editor/icons.h"
#include "viewer/editor/modal.h"
#include "viewer/editor/texts.h"
#include "viewer/editor/theme.h"
#include "viewer/overlay.h"

namespace ewa::viewer {
namespace {

constexpr size_t kCardFiles = 5;
// In heights of the text.
constexpr float kCardWidth = 28, kHelpColumn = 31;

/// Moves the cursor so that an item of this width is in the middle of the window.
void center_item(float width) {
    ImGui::SetCursorPosX(std::max(ImGui::GetStyle().WindowPadding.x, (ImGui::GetWindowWidth() - width) / 2));
}

/// Text in the middle of the window. It wraps where it is too wide.
void center_text(const char* text, bool quiet) {
    center_item(ImGui::CalcTextSize(text).x);
    ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetColorU32(quiet ? ImGuiCol_TextDisabled : ImGuiCol_Text));
    ImGui::TextWrapped("%s", text);
    ImGui::PopStyleColor();
}

/// One line that is as large as the card allows.
void draw_title(const char* text) {
    ImGui::PushFont(ImGui::GetIO().Fonts->Fonts.back());  // the large one of Gui
    const float room = ImGui::GetContentRegionAvail().x, width = ImGui::CalcTextSize(text).x;
    ImGui::SetWindowFontScale(std::min(0.7f, room / std::max(1.0f, width)));
    center_item(ImGui::CalcTextSize(text).x);
    ImGui::TextUnformatted(text);
    ImGui::SetWindowFontScale(1);
    ImGui::PopFont();
}

/// The two buttons, beside each other where there is room.
void draw_open_buttons(Welcome& welcome) {
    const ImGuiStyle& style = ImGui::GetStyle();
    const auto width = [&](const char* name) {
        return ImGui::CalcTextSize(name).x + 2 * style.FramePadding.x;
    };
    const float file = width(texts::kOpenAFile), folder = width(texts::kOpenAFolder);
    const float both = file + style.ItemSpacing.x + folder;
    const bool beside = both <= ImGui::GetContentRegionAvail().x;
    center_item(beside ? both : file);
    if (accent_button(texts::kOpenAFile)) welcome.wanted = Wanted::file;
    if (beside)
        ImGui::SameLine();
    else
        center_item(folder);
    if (ImGui::Button(texts::kOpenAFolder)) welcome.wanted = Wanted::folder;
}

/// "Ctrl + A" for "Ctrl+A".
std::string spaced_keys(std::string_view keys) {
    std::string text;
    for (const char c : keys)
        text += c == '+' && !text.empty() && text.back() != ' ' ? " + " : std::string(1, c);
    return text;
}

/// Calls visit(keys, text) for the tools of the group that have keys, and for its rows.
template <class Visit>
void for_each_row(const texts::HelpGroup& group, Visit visit) {
    for (const texts::ToolText& tool : texts::kTools)
        if (tool.tool >= group.first && tool.tool < group.end && *tool.key) visit(tool.key, tool.name);
    for (const texts::HelpRow& row : group.rows) visit(spaced_keys(row.keys), row.text);
}

void draw_help_group(const texts::HelpGroup& group, float keys) {
    ImGui::TextDisabled("%s", group.name);
    if (!ImGui::BeginTable(group.name, 2, ImGuiTableFlags_SizingFixedFit)) return;
    ImGui::TableSetupColumn("keys", ImGuiTableColumnFlags_WidthFixed, keys);
    ImGui::TableSetupColumn("text", ImGuiTableColumnFlags_WidthStretch);
    for_each_row(group, [](const std::string& row_keys, const char* row_text) {
        for (const char* text : {row_keys.c_str(), row_text}) {
            ImGui::TableNextColumn();
            ImGui::PushTextWrapPos(0);
            ImGui::TextUnformatted(text);
            ImGui::PopTextWrapPos();
        }
    });
    ImGui::EndTable();
    ImGui::Spacing();
}

void draw_help_groups(int columns) {
    float keys = 0;
    for (const texts::HelpGroup& group : texts::kHelpGroups)
        for_each_row(group, [&](const std::string& row_keys, const char* /*text*/) {
            keys = std::max(keys, ImGui::CalcTextSize(row_keys.c_str()).x);
        });
    keys = std::min(keys + 1, 0.4f * ImGui::GetContentRegionAvail().x / float(columns));  // longer ones wrap
    if (!ImGui::BeginTable("columns", columns, ImGuiTableFlags_SizingStretchSame)) return;
    for (const bool second : {false, true}) {
        ImGui::TableNextColumn();
        for (const texts::HelpGroup& group : texts::kHelpGroups)
            if (group.second == second) draw_help_group(group, keys);
    }
    ImGui::EndTable();
}

}  // namespace

std::optional<std::filesystem::path> draw_recent() {
    static std::vector<std::filesystem::path> recent;  // as of the time when the window appeared
    std::optional<std::filesystem::path> chosen;
    if (ImGui::IsWindowAppearing()) recent = recent_files();
    if (recent.empty()) return chosen;
    ImGui::Spacing();
    ImGui::TextDisabled("%s", texts::kRecent);
    for (size_t i = 0; i < std::min(recent.size(), kCardFiles); ++i) {
        const std::filesystem::path& file = recent[i];
        ImGui::PushID(int(i));
        if (ImGui::Selectable(core::one_line(file.filename().string()).c_str(), false,
                              ImGuiSelectableFlags_DontClosePopups))
            chosen = file;
        if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", core::one_line(file.string()).c_str());
        ImGui::PopID();
    }
    return chosen;
}

Welcome draw_welcome(const Rectangle& area) {
    Welcome welcome;
    const ImVec2 low = gui_point(area.x, area.y), high = gui_point(area.x + area.width, area.y + area.height);
    ImGui::GetBackgroundDrawList()->AddRectFilled(low, high, backdrop());
    const float line = ImGui::GetTextLineHeight(), height = high.y - low.y;
    const float width = std::clamp(high.x - low.x - line, line, kCardWidth * line);
    ImGui::SetNextWindowPos({(low.x + high.x) / 2, (low.y + high.y) / 2}, ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::SetNextWindowSizeConstraints({width, 0}, {width, std::max(line, height)});
    const float margin = std::min(1.5f * line, 0.08f * height);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(margin, margin));
    const bool open = ImGui::Begin("welcome", nullptr,
                                   ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize |
                                       ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                                       ImGuiWindowFlags_NoFocusOnAppearing);
    if (open) {
        if (height > 15 * line) {  // a low window has room for the rest alone
            const float size = 3 * line;
            center_item(size);
            const ImVec2 at = ImGui::GetCursorScreenPos();
            draw_icon(Icon::drop, {at.x + size / 2, at.y + size / 2}, size, accent());
            ImGui::Dummy({size, size});
        }
        draw_title(texts::kDropTitle);
        center_text(texts::kDropExplanation, true);
        ImGui::Dummy({0, 0.3f * line});
        draw_open_buttons(welcome);
        welcome.file = draw_recent();
        center_text(texts::kKeysLine, true);
    }
    ImGui::End();
    ImGui::PopStyleVar();
    return welcome;
}

void draw_help(bool& open) {
    const ImVec2 room = ImGui::GetIO().DisplaySize;
    const float line = ImGui::GetTextLineHeight();
    const int columns = room.x > 2 * kHelpColumn * line ? 2 : 1;
    const float width = std::max(line, std::min(room.x - line, float(columns) * kHelpColumn * line));
    ImGui::SetNextWindowPos({room.x / 2, room.y / 2}, ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::SetNextWindowSizeConstraints({width, 0},
                                        {width, std::max(line, room.y - line)});  // a longer list scrolls
    ImGui::SetNextWindowBgAlpha(1);                                               // other text lies behind it
    ImGui::PushStyleColor(ImGuiCol_WindowBg, ImGui::GetColorU32(ImGuiCol_PopupBg));
    if (ImGui::Begin("Keys", &open,
                     ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse |
                         ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings)) {
        draw_help_groups(columns);
        // A click on a button elsewhere is that button's.
        if (ImGui::IsMouseClicked(ImGuiMouseButton_Left) &&
            !ImGui::IsWindowHovered(ImGuiHoveredFlags_ChildWindows) && !ImGui::IsAnyItemHovered())
            open = false;
    }
    ImGui::End();
    ImGui::PopStyleColor();
}

}  // namespace ewa::viewer
