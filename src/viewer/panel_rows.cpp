// SPDX-License-Identifier: Apache-2.0
#include "viewer/panel_rows.h"

#include <imgui.h>

#include <algorithm>
#include <cfloat>
#include <cmath>

namespace ewa::viewer {
namespace {

constexpr float kLabelColumn = 6.2f;  // in heights of the text

}  // namespace

void label_field(const char* label) {
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(label);
    const float needed = ImGui::CalcTextSize(label).x + ImGui::GetStyle().ItemInnerSpacing.x;
    ImGui::SameLine(std::max(kLabelColumn * ImGui::GetTextLineHeight(), needed));
    ImGui::SetNextItemWidth(-FLT_MIN);
}

bool draw_section(const char* name, bool open, bool open_now) {
    ImGui::Separator();
    if (open_now) ImGui::SetNextItemOpen(true);
    ImGui::PushStyleColor(ImGuiCol_Header, ImU32(0));
    const bool shown = ImGui::CollapsingHeader(name, open ? ImGuiTreeNodeFlags_DefaultOpen : 0);
    ImGui::PopStyleColor();
    return shown;
}

int text_lines(const std::string& text, int most) {
    if (text.empty()) return 0;
    const float height =
        ImGui::CalcTextSize(text.c_str(), nullptr, false, ImGui::GetContentRegionAvail().x).y;
    return std::min(most, int(std::lround(height / ImGui::GetTextLineHeight())));
}

void draw_text_box(const char* name, const std::string& text, int least, int most) {
    const int lines = std::max(least, text_lines(text, most));
    if (lines == 0) return;
    ImGui::BeginChild(name, ImVec2(0, float(lines) * ImGui::GetTextLineHeight()));
    ImGui::PushTextWrapPos(0);
    ImGui::TextUnformatted(text.c_str());
    ImGui::PopTextWrapPos();
    ImGui::EndChild();
}

}  // namespace ewa::viewer
