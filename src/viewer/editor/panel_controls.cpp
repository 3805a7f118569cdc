// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/panel_controls.h"

#include <imgui.h>

#include <algorithm>
#include <cfloat>
#include <string>
#include <vector>

#include "viewer/editor/theme.h"
#include "viewer/panel_rows.h"

namespace ewa::viewer::ui {
namespace {

constexpr float kHintWidth = 20;         // heights of the text
constexpr double kHintPause = 0.7;       // s after a click, without hints
constexpr float kChosenOpacity = 0.35f;  // of the accent behind a chosen button

/// A colour of the style in red, as light as it was.
ImVec4 reddish(ImGuiCol color) {
    const ImVec4& plain = ImGui::GetStyleColorVec4(color);
    float hue = 0, saturation = 0, value = 0;
    ImGui::ColorConvertRGBtoHSV(plain.x, plain.y, plain.z, hue, saturation, value);
    ImVec4 red(0, 0, 0, plain.w);
    ImGui::ColorConvertHSVtoRGB(0, 0.45f, std::max(0.35f, value), red.x, red.y, red.z);
    return red;
}

void push_look(ButtonLook look) {
    for (const ImGuiCol color : {ImGuiCol_Button, ImGuiCol_ButtonHovered, ImGuiCol_ButtonActive}) {
        if (look == ButtonLook::danger)
            ImGui::PushStyleColor(color, reddish(color));
        else if (look == ButtonLook::chosen)
            ImGui::PushStyleColor(color, ImU32(accent(kChosenOpacity)));
        else
            ImGui::PushStyleColor(color, ImGui::GetStyleColorVec4(color));
    }
}

}  // namespace

void show_hint(const char* hint, const char* keys) {
    static double held = -1;  // when the mouse was held last: a hint must not cover what it has changed
    if (ImGui::IsMouseDown(ImGuiMouseButton_Left)) held = ImGui::GetTime();
    const bool rests = held < 0 || ImGui::GetTime() > held + kHintPause;
    if (!rests || !*hint || !ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) return;
    const std::string text = hint;
    const size_t end = std::min(text.find('\n'), text.size());
    const std::string first = text.substr(0, end) + (*keys ? std::string(" (") + keys + ")" : "");
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(kHintWidth * ImGui::GetTextLineHeight());
    ImGui::TextUnformatted(first.c_str());
    if (end < text.size()) ImGui::TextDisabled("%s", text.c_str() + end + 1);
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
}

bool section(const Text& text, bool open_at_first, bool open_now) {
    const bool open = draw_section(text.name, open_at_first, open_now);
    if (!open) show_hint(text.hint);
    return open;
}

void label_left(const Text& text) {
    label_field(text.name);
    show_hint(text.hint);
}

void label_above(const Text& text) {
    ImGui::TextDisabled("%s", text.name);
    show_hint(text.hint);
    ImGui::SetNextItemWidth(-FLT_MIN);
}

int button_line(std::span<const Button> buttons, float gap) {
    if (gap < 0) gap = ImGui::GetStyle().ItemSpacing.x;
    const float room = ImGui::GetContentRegionAvail().x - gap * float(buttons.size() - 1);
    float texts = 0, longest = 0;
    for (const Button& button : buttons) {
        texts += ImGui::CalcTextSize(button.text.name).x;
        longest = std::max(longest, ImGui::CalcTextSize(button.text.name).x);
    }
    const float equal = room / float(buttons.size());
    const float around = std::max(0.0f, (room - texts) / float(buttons.size()));
    const bool all_fit = longest + 2 * ImGui::GetStyle().FramePadding.x <= equal;
    int clicked = -1;
    for (size_t i = 0; i < buttons.size(); ++i) {
        const Button& button = buttons[i];
        if (i > 0) ImGui::SameLine(0, gap);
        ImGui::BeginDisabled(!button.enabled);
        push_look(button.look);
        const float width = all_fit ? equal : ImGui::CalcTextSize(button.text.name).x + around;
        if (ImGui::Button(button.text.name, ImVec2(width, 0))) clicked = int(i);
        ImGui::PopStyleColor(3);
        ImGui::EndDisabled();
        show_hint(button.text.hint, button.text.keys);
    }
    return clicked;
}

int button_line(std::initializer_list<Button> buttons) {
    return button_line(std::span(buttons.begin(), buttons.size()));
}

bool segments(std::span<const Text> names, int& chosen) {
    std::vector<Button> buttons;
    for (size_t i = 0; i < names.size(); ++i)
        buttons.push_back({names[i], true, int(i) == chosen ? ButtonLook::chosen : ButtonLook::plain});
    const int clicked = button_line(buttons, 1);
    if (clicked < 0 || clicked == chosen) return false;
    chosen = clicked;
    return true;
}

bool checkbox(const Text& text, bool& value) {
    const bool changed = ImGui::Checkbox(text.name, &value);
    show_hint(text.hint);
    return changed;
}

bool slider(const Text& text, float& value, float low, float high, const char* format, bool logarithmic) {
    label_left(text);
    ImGui::PushID(text.name);
    const ImGuiSliderFlags flags =
        ImGuiSliderFlags_AlwaysClamp | (logarithmic ? ImGuiSliderFlags_Logarithmic : 0);
    const bool changed = ImGui::SliderFloat("##slider", &value, low, high, format, flags);
    ImGui::PopID();
    show_hint(text.hint);
    return changed;
}

bool numbers(const Text& text, glm::dvec3& values) {
    label_above(text);
    ImGui::PushID(text.name);
    const bool changed = ImGui::InputScalarN("##numbers", ImGuiDataType_Double, &values[0], 3, nullptr,
                                             nullptr, "%.6g", ImGuiInputTextFlags_CharsScientific);
    ImGui::PopID();
    return changed;
}

bool number(const Text& text, double& value) {
    label_left(text);
    ImGui::PushID(text.name);
    const bool changed = ImGui::InputScalar("##number", ImGuiDataType_Double, &value, nullptr, nullptr,
                                            "%.6g", ImGuiInputTextFlags_CharsScientific);
    ImGui::PopID();
    return changed;
}

bool entered() {
    if (!ImGui::IsItemDeactivatedAfterEdit()) return false;
#if IMGUI_VERSION_NUM < 18700
    return ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Enter), false);
#else
    return ImGui::IsKeyPressed(ImGuiKey_Enter, false);
#endif
}

}  // namespace ewa::viewer::ui
