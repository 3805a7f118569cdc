// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/toolbar.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "core/text.h"
#include "viewer/editor/edit_words.h"
#include "viewer/editor/icons.h"
#include "viewer/editor/texts.h"
#include "viewer/editor/theme.h"
#include "viewer/overlay.h"

namespace ewa::viewer {
namespace {

// In heights of the text.
constexpr float kButtonSide = 2.1f, kSmall = 0.8f;
// In sides of a button.
constexpr float kButtonGap = 0.1f, kGroupGap = 0.3f, kDot = 0.1f;
constexpr double kEditShown = 6;  // seconds in which the status line shows the last edit

struct BarButton {
    Icon icon;
    texts::Item text;
    std::function<void()> act;
    bool enabled = true, active = false, apart = false;  // apart: a separator is before it
    std::function<void()> menu = {};                     // of a right click
    bool dot = false;                                    // there is something to do
};
using BarButtons = std::vector<BarButton>;

/// The part of the window that the bars frame, in ImGui's coordinates.
struct BarArea {
    ImVec2 low, high;
    float top, left, bottom;  // of bar_sizes()
};

BarArea bar_area(const Rectangle& area) {
    const ImVec2 scale = ImGui::GetIO().DisplayFramebufferScale;
    const float x = 1 / std::max(scale.x, 1e-3f), y = 1 / std::max(scale.y, 1e-3f);
    const BarSizes sizes = bar_sizes(double(ImGui::GetTextLineHeight()) / double(y));
    return {gui_point(area.x, area.y), gui_point(area.x + area.width, area.y + area.height),
            float(sizes.top) * y, float(sizes.left) * x, float(sizes.bottom) * y};
}

bool begin_bar(const char* name, const ImVec2& low, const ImVec2& high) {
    ImGui::SetNextWindowPos(low);
    ImGui::SetNextWindowSize({high.x - low.x, high.y - low.y});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0, 0));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, ImVec2(1, 1));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 0);
    const bool open = ImGui::Begin(
        name, nullptr,
        ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
            ImGuiWindowFlags_NoBringToFrontOnFocus | ImGuiWindowFlags_NoFocusOnAppearing |
            ImGuiWindowFlags_NoNav | ImGuiWindowFlags_NoScrollWithMouse);
    ImGui::PopStyleVar(4);
    return open;
}

/// The length of the first `count` buttons.
float bar_length(const BarButtons& buttons, size_t count, float side) {
    float length = 0;
    for (size_t i = 0; i < count; ++i) length += side * (1 + kButtonGap + (buttons[i].apart ? kGroupGap : 0));
    return length;
}

/// The side of the buttons, and how many of them fit. The others are behind one more button.
struct BarFit {
    float side;
    size_t shown;
    float length;  // of all that is drawn
};
BarFit fit_bar(const BarButtons& buttons, float room) {
    const float usual = kButtonSide * ImGui::GetTextLineHeight(), small = kSmall * usual;
    for (const float side : {usual, small})
        if (const float length = bar_length(buttons, buttons.size(), side); length <= room)
            return {side, buttons.size(), length};
    size_t shown = buttons.size();
    while (shown > 0 && bar_length(buttons, shown, small) + small > room) --shown;
    return {small, shown, bar_length(buttons, shown, small) + small};
}

/// The buttons that do not fit.
void draw_more(const BarButtons& buttons, size_t from, float side) {
    const bool active = std::any_of(buttons.begin() + std::ptrdiff_t(from), buttons.end(),
                                    [](const BarButton& button) { return button.active; });
    if (icon_button(Icon::more, texts::kMore, active, true, side)) ImGui::OpenPopup("more");
    if (!ImGui::BeginPopup("more")) return;
    for (size_t i = from; i < buttons.size(); ++i) {
        const BarButton& button = buttons[i];
        if (button.apart && i > from) ImGui::Separator();
        if (ImGui::MenuItem(button.text.name, button.text.keys, button.active, button.enabled)) button.act();
    }
    ImGui::EndPopup();
}

/// Draws the buttons from `at` to the right, or down. breadth: of the bar.
void draw_buttons(const BarButtons& buttons, const BarFit& fit, ImVec2 at, bool down, float breadth) {
    const float side = fit.side, inset = (breadth - side) / 2;
    float& along = down ? at.y : at.x;
    (down ? at.x : at.y) += inset;
    ImGui::PushID(buttons.front().text.name);
    for (size_t i = 0; i < fit.shown; ++i) {
        if (buttons[i].apart) {
            const float middle = along + side * (kGroupGap - kButtonGap) / 2, cut = 0.15f * side;
            const ImVec2 from = down ? ImVec2(at.x + cut, middle) : ImVec2(middle, at.y + cut),
                         to = down ? ImVec2(at.x + side - cut, middle) : ImVec2(middle, at.y + side - cut);
            ImGui::GetWindowDrawList()->AddLine(from, to, ImGui::GetColorU32(ImGuiCol_Separator));
            along += side * kGroupGap;
        }
        ImGui::SetCursorScreenPos(at);
        const BarButton& button = buttons[i];
        const std::string tooltip = std::string(button.text.name) + "\n" + button.text.hint;
        if (icon_button(button.icon, tooltip.c_str(), button.active, button.enabled, side, button.text.keys))
            button.act();
        if (button.dot)
            ImGui::GetWindowDrawList()->AddCircleFilled({at.x + 0.85f * side, at.y + 0.15f * side},
                                                        kDot * side, accent());
        if (button.menu) button.menu();
        along += side * (1 + kButtonGap);
    }
    ImGui::SetCursorScreenPos(at);
    if (fit.shown < buttons.size()) draw_more(buttons, fit.shown, side);
    ImGui::PopID();
}

/// The menu of the button that saves.
void choose_save(Dialogs& dialogs) {
    if (!ImGui::BeginPopupContextItem("save")) return;
    if (ImGui::MenuItem(texts::kSave.name, texts::kSave.keys)) dialogs.save();
    if (ImGui::MenuItem(texts::kSaveAs)) dialogs.save_as();
    ImGui::EndPopup();
}

BarButtons top_buttons(const WindowParts& parts) {
    const Editor& editor = parts.editor;
    const EditSnapshot& now = editor.snapshot();
    const bool splats = now.left > 0, can_save = editor.scenes() > 0 && !editor.saving();
    std::function<void()> menu;
    if (can_save) menu = [&parts] { choose_save(parts.dialogs); };
    const auto save = [&parts] { ImGui::GetIO().KeyShift ? parts.dialogs.save_as() : parts.dialogs.save(); };
    const auto clean = [&parts] {
        parts.state.panel_wanted() = true;
        parts.state.settings.tab = PanelTab::edit;
        parts.edits.show_cleaning();
    };
    return {{Icon::open, texts::kOpenFile, [&parts] { parts.session.dialog.ask(Wanted::file); }},
            {Icon::save, texts::kSave, save, can_save, false, false, menu, editor.unsaved()},
            {Icon::undo, texts::kUndo, [&parts] { parts.editor.undo(); }, now.done > 0, false, true},
            {Icon::redo, texts::kRedo, [&parts] { parts.editor.redo(); }, now.done < now.steps.size()},
            {Icon::clean, texts::kClean, clean, splats, false, true},
            {Icon::film, texts::kFilm, [&parts] { parts.film.shown = !parts.film.shown; },
             splats || parts.film.shown, parts.film.shown},
            {Icon::publish, texts::kPublish, [&parts] { parts.dialogs.publish(parts.film.views_file()); },
             splats},
            {Icon::picture, texts::kPicture, [&parts] { parts.film.open_picture(); }}};
}

/// A line that moves while edits are being done.
void draw_busy(const ImVec2& low, const ImVec2& high) {
    const float width = high.x - low.x, thickness = std::max(2.0f, 0.12f * ImGui::GetTextLineHeight());
    const float from = low.x + width * (1.3f * float(std::fmod(ImGui::GetTime() / 1.4, 1.0)) - 0.3f);
    ImGui::GetWindowDrawList()->AddRectFilled({std::max(low.x, from), high.y - thickness},
                                              {std::min(high.x, from + 0.3f * width), high.y}, accent());
}

void draw_top(const WindowParts& parts, const BarArea& area) {
    const ImVec2 high(area.high.x, area.low.y + area.top);
    if (begin_bar("top bar", area.low, high)) {
        ViewState& state = parts.state;
        const BarButtons right{
            {Icon::panel, texts::kPanel, [&state] { state.panel_wanted() = !state.panel_wanted(); }, true,
             state.panel_shown()},
            {Icon::help, texts::kHelp, [&state] { state.help = !state.help; }}};
        const BarButtons left = top_buttons(parts);
        const float margin = (area.left - kButtonSide * ImGui::GetTextLineHeight()) / 2;
        const float room = high.x - area.low.x - 2 * margin;
        const BarFit right_fit = fit_bar(right, 0.4f * room),
                     left_fit = fit_bar(left, room - right_fit.length);
        draw_buttons(left, left_fit, {area.low.x + margin, area.low.y}, false, area.top);
        draw_buttons(right, right_fit, {high.x - margin - right_fit.length, area.low.y}, false, area.top);
        if (parts.editor.busy() || parts.editor.saving()) draw_busy(area.low, high);
    }
    ImGui::End();
}

void draw_strip(Editor& editor, bool points, const BarArea& area) {
    const ImVec2 low(area.low.x, area.low.y + area.top),
        high(area.low.x + area.left, area.high.y - area.bottom);
    if (high.y - low.y < area.left) return;
    if (begin_bar("tools", low, high)) {
        BarButtons tools;
        for (const texts::ToolText& tool : texts::kTools) {
            const bool first =
                tool.tool == Tool::rectangle || tool.tool == Tool::move || tool.tool == Tool::measure;
            const char* problem = points && tool.tool != Tool::view                 ? texts::kPointsEdited
                                  : editor.settings.live && moves_splats(tool.tool) ? texts::kLiveRefuses
                                                                                    : nullptr;
            tools.push_back({Icon(tool.tool),
                             {tool.name, problem ? problem : tool.hint, tool.key},
                             [&editor, chosen = tool.tool] { editor.settings.tool = chosen; },
                             !problem,
                             editor.settings.tool == tool.tool,
                             first});
        }
        draw_buttons(tools, fit_bar(tools, high.y - low.y), low, true, area.left);
    }
    ImGui::End();
}

/// What the last edit did, for some seconds; then the hint of the active tool.
std::string status_text(const Editor& editor) {
    static struct {
        EditSnapshot snapshot;
        double until = 0;
        std::string text;
    } last;  // seen in the frame before
    const EditSnapshot& now = editor.snapshot();
    if (now.version != last.snapshot.version || now.scene != last.snapshot.scene) {
        last.text = now.scene == last.snapshot.scene ? edit_news(last.snapshot, now) : "";
        last.snapshot = now;
        last.snapshot.splats = last.snapshot.drawn = nullptr;
        last.snapshot.states = last.snapshot.marks = nullptr;
        last.snapshot.draft = {};
        last.snapshot.cameras = {};
        last.until = ImGui::GetTime() + kEditShown;
    }
    if (!editor.settings.progress.empty()) return editor.settings.progress;
    if (!last.text.empty() && ImGui::GetTime() < last.until) return last.text;
    return texts::kTools[size_t(editor.settings.tool)].hint;
}

/// The text without its end, if it is wider than this.
std::string shortened(std::string text, float width) {
    if (ImGui::CalcTextSize(text.c_str()).x <= width) return text;
    const auto inside = [&] {
        return !text.empty() && (static_cast<unsigned char>(text.back()) & 0xc0) == 0x80;
    };
    while (!text.empty() && ImGui::CalcTextSize((text + "...").c_str()).x > width) {
        while (inside()) text.pop_back();  // the later bytes of a character
        if (!text.empty()) text.pop_back();
    }
    return text.empty() ? text : text + "...";
}

std::string selection_text(const Editor& editor) {
    if (editor.saving()) return texts::kSaving;
    if (const auto count = editor.preview_count())
        return core::grouped(*count, "splat") + " " + texts::kWouldBeRemoved;
    if (const size_t selected = editor.snapshot().selected; selected > 0)
        return core::grouped(selected) + " " + texts::kSelected;
    return editor.settings.live ? texts::kEditsTraining : "";
}

void draw_status(const Editor& editor, const std::string& device, const BarArea& area) {
    const ImVec2 low(area.low.x, area.high.y - area.bottom);
    if (begin_bar("status", low, area.high)) {
        ImDrawList& list = *ImGui::GetWindowDrawList();
        const float line = ImGui::GetTextLineHeight(), y = low.y + (area.bottom - line) / 2;
        float from = low.x + 0.6f * line, to = area.high.x - 0.6f * line;
        const auto width = [](const std::string& text) { return ImGui::CalcTextSize(text.c_str()).x; };
        const std::string middle = selection_text(editor);
        const float half = width(middle) / 2, center = (from + to) / 2;
        const ImU32 quiet = ImGui::GetColorU32(ImGuiCol_TextDisabled);
        if (const float right = width(device); to - right > center + half + line) {
            list.AddText({to - right, y}, quiet, device.c_str());
            to -= right + line;
        }
        if (!middle.empty()) {
            list.AddText({std::max(from, center - half), y}, ImGui::GetColorU32(ImGuiCol_Text),
                         middle.c_str());
            to = center - half - line;
        }
        list.AddText({from, y}, quiet, shortened(status_text(editor), to - from).c_str());
    }
    ImGui::End();
}

}  // namespace

void draw_bars(const WindowParts& parts) {
    const BarArea area = bar_area(parts.state.frame_area());
    draw_top(parts, area);
    draw_strip(parts.editor, parts.state.scene.points, area);
    draw_status(parts.editor, parts.state.device_name, area);
}

}  // namespace ewa::viewer
