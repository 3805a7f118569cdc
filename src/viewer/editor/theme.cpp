// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/theme.h"

#include <imgui.h>

namespace ewa::viewer {
namespace {

bool light_theme = false;  // what set_theme() was called with

struct ThemeColor {
    ImGuiCol item;
    unsigned dark, light;  // 0xRRGGBB
    float opacity = 1;
};
constexpr unsigned kAccentDark = 0xf2a93b, kAccentLight = 0x854a00;
constexpr unsigned kBackdropDark = 0x17181a, kBackdropLight = 0xd9dbde;

/// Text has a contrast of at least 7 to what lies behind it (WCAG 2), but for the number over a knob that moves.
constexpr ThemeColor kThemeColors[] = {
    {ImGuiCol_Text, 0xecedef, 0x1b1c1e},
    {ImGuiCol_TextDisabled, 0xb9bcc2, 0x484b50},
    {ImGuiCol_TextSelectedBg, kAccentDark, kAccentLight, 0.35f},
    {ImGuiCol_WindowBg, 0x212225, 0xf6f6f7},
    {ImGuiCol_ChildBg, 0, 0, 0},
    {ImGuiCol_PopupBg, 0x2a2b2f, 0xffffff},
    {ImGuiCol_MenuBarBg, 0x212225, 0xf6f6f7},
    {ImGuiCol_Border, 0x3d3f45, 0xcfd1d6},
    {ImGuiCol_BorderShadow, 0, 0, 0},
    {ImGuiCol_Separator, 0x3d3f45, 0xcfd1d6},
    {ImGuiCol_SeparatorHovered, kAccentDark, kAccentLight, 0.6f},
    {ImGuiCol_SeparatorActive, kAccentDark, kAccentLight},
    {ImGuiCol_TitleBg, 0x2a2b2f, 0xe9eaed},
    {ImGuiCol_TitleBgActive, 0x2a2b2f, 0xe9eaed},
    {ImGuiCol_TitleBgCollapsed, 0x2a2b2f, 0xe9eaed},
    {ImGuiCol_FrameBg, 0x303236, 0xe6e7ea},
    {ImGuiCol_FrameBgHovered, 0x3a3c42, 0xdbdde1},
    {ImGuiCol_FrameBgActive, 0x43464c, 0xd0d3d8},
    {ImGuiCol_Button, 0x36383d, 0xe1e3e7},
    {ImGuiCol_ButtonHovered, 0x41444a, 0xd5d8dd},
    {ImGuiCol_ButtonActive, 0x4c5057, 0xc8ccd2},
    {ImGuiCol_Header, kAccentDark, kAccentLight, 0.25f},  // the chosen row of a list
    {ImGuiCol_HeaderHovered, 0x3a3c42, 0xe3e5e9},
    {ImGuiCol_HeaderActive, 0x43464c, 0xd6d9de},
    {ImGuiCol_Tab, 0x2a2b2f, 0xe9eaed},
    {ImGuiCol_TabHovered, 0x41444a, 0xd5d8dd},
    {ImGuiCol_TabActive, 0x36383d, 0xffffff},
    {ImGuiCol_CheckMark, kAccentDark, kAccentLight},
    {ImGuiCol_SliderGrab, 0x8d9199, 0x868b93, 0.3f},  // the number shows through
    {ImGuiCol_SliderGrabActive, kAccentDark, kAccentLight, 0.3f},
    {ImGuiCol_PlotLines, 0xb9bcc2, 0x484b50},
    {ImGuiCol_PlotLinesHovered, kAccentDark, kAccentLight},
    {ImGuiCol_PlotHistogram, kAccentDark, kAccentLight},
    {ImGuiCol_PlotHistogramHovered, kAccentDark, kAccentLight},
    {ImGuiCol_ScrollbarBg, 0, 0, 0},
    {ImGuiCol_ScrollbarGrab, 0x46494f, 0xc3c6cc},
    {ImGuiCol_ScrollbarGrabHovered, 0x565a61, 0xb0b4bb},
    {ImGuiCol_ScrollbarGrabActive, 0x666a72, 0x9ca1a9},
    {ImGuiCol_ResizeGrip, 0, 0, 0},
    {ImGuiCol_ResizeGripHovered, 0x565a61, 0xb0b4bb},
    {ImGuiCol_ResizeGripActive, kAccentDark, kAccentLight},
    {ImGuiCol_TableHeaderBg, 0x2a2b2f, 0xe9eaed},
    {ImGuiCol_TableBorderStrong, 0x3d3f45, 0xcfd1d6},
    {ImGuiCol_TableBorderLight, 0x303236, 0xdfe1e5},
    {ImGuiCol_DragDropTarget, kAccentDark, kAccentLight},
    {ImGuiCol_NavHighlight, kAccentDark, kAccentLight},
    {ImGuiCol_ModalWindowDimBg, 0, 0, 0.5f},
};

ImVec4 theme_color(unsigned rgb, float opacity) {
    const auto channel = [&](unsigned shift) { return float((rgb >> shift) & 255) / 255; };
    return {channel(16), channel(8), channel(0), opacity};
}

}  // namespace

void set_theme(bool light) {
    light_theme = light;
    ImGuiStyle& style = ImGui::GetStyle() = ImGuiStyle();
    light ? ImGui::StyleColorsLight() : ImGui::StyleColorsDark();
    for (const ThemeColor& color : kThemeColors)
        style.Colors[color.item] = theme_color(light ? color.light : color.dark, color.opacity);
    style.WindowPadding = {12, 10};
    style.FramePadding = {8, 4};
    style.ItemSpacing = {8, 7};
    style.ItemInnerSpacing = {7, 5};
    style.CellPadding = {6, 3};
    style.IndentSpacing = 16;
    style.ScrollbarSize = 10;
    style.GrabMinSize = 12;
    style.WindowRounding = style.PopupRounding = 8;
    style.ChildRounding = style.FrameRounding = style.TabRounding = 5;
    style.GrabRounding = 4;
    style.ScrollbarRounding = 6;
    style.WindowBorderSize = 1;
    style.PopupBorderSize = 1;
    style.FrameBorderSize = 0;
    style.WindowTitleAlign = {0.5f, 0.5f};
    style.WindowMenuButtonPosition = ImGuiDir_None;
    style.DisabledAlpha = 0.4f;
}

unsigned accent(float opacity) {
    return ImGui::ColorConvertFloat4ToU32(theme_color(light_theme ? kAccentLight : kAccentDark, opacity));
}

unsigned on_accent() {
    return ImGui::ColorConvertFloat4ToU32(theme_color(light_theme ? 0xffffff : kBackdropDark, 1));
}

unsigned backdrop() {
    return ImGui::ColorConvertFloat4ToU32(theme_color(light_theme ? kBackdropLight : kBackdropDark, 1));
}

}  // namespace ewa::viewer
