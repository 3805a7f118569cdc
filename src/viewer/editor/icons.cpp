// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/icons.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <string>
#include <string_view>

#include "core/text.h"
#include "viewer/editor/panel_controls.h"
#include "viewer/editor/theme.h"

namespace ewa::viewer {
namespace {

constexpr float kGrid = 24, kStroke = 1.6f;
constexpr float kIconShare = 0.64f;  // of the button's side

/// In the order of Icon, y down. M x y begins a line, L x y continues straight, B with three points by a Bézier curve, and A x y r
/// from to by an arc (degrees). Z closes the line. C x y r is a circle, D x y r a disc.
constexpr std::array<std::string_view, size_t(Icon::drop) + 1> kShapes{
    // view: a body with an orbit
    "C 12 12 5 M 15.8 6.7 B 19.8 5.9 22.3 6.8 21.7 8.8 B 21.2 10.9 17.9 13.6 13.6 15.6 B 9.3 17.5 5 18.1 3.1 "
    "17.1 B 1.3 16.1 2.2 13.7 5.5 11.3",
    // rectangle: dashes
    "M 3.5 8 L 3.5 5 L 6.5 5 M 10 5 L 14 5 M 17.5 5 L 20.5 5 L 20.5 8 M 20.5 10.5 L 20.5 13.5 M 20.5 16 L "
    "20.5 19 L 17.5 19 M 14 19 "
    "L 10 19 M 6.5 19 L 3.5 19 L 3.5 16 M 3.5 13.5 L 3.5 10.5",
    // lasso: a loop with a knot
    "M 7 14.6 B 4.8 13.6 3.5 11.8 3.5 9.8 B 3.5 6.3 7.3 3.8 12 3.8 B 16.7 3.8 20.5 6.3 20.5 9.8 B 20.5 13.3 "
    "16.7 15.7 12 15.7 B 11.2 "
    "15.7 10.5 15.6 9.8 15.5 C 8.2 15.9 1.8 M 8.4 17.7 B 9 19.4 8.2 20.7 6.2 20.9",
    // polygon: lines from dot to dot
    "M 5.5 18.5 L 4.5 8.5 L 13 4.2 L 19.8 10.5 L 16.5 19 Z D 5.5 18.5 2 D 4.5 8.5 2 D 13 4.2 2 D 19.8 10.5 2 "
    "D 16.5 19 2",
    // brush
    "M 20.5 3.5 L 10.4 10.9 L 13.1 13.6 Z M 8.9 12.2 B 6.4 12.4 5.4 14.4 5.3 16.4 B 5.2 18 4.6 19 3.3 19.6 B "
    "5.4 20.9 8.2 20.8 10 19.5 B "
    "11.6 18.3 12.2 16.8 11.9 15.1",
    // sphere
    "C 12 12 8.7 M 3.3 12 B 3.3 14.1 7.2 15.6 12 15.6 B 16.8 15.6 20.7 14.1 20.7 12",
    // box
    "M 12 3 L 19.8 7.4 L 19.8 16.6 L 12 21 L 4.2 16.6 L 4.2 7.4 Z M 4.2 7.4 L 12 11.8 L 19.8 7.4 M 12 11.8 L "
    "12 21",
    // flood: a wand
    "M 3.2 18.6 L 5.4 20.8 L 16.2 10 L 14 7.8 Z M 11.6 10.2 L 13.8 12.4 M 18.6 3 L 18.6 6.4 M 16.9 4.7 L "
    "20.3 4.7 M 20 11.6 L 20 14.4 M "
    "18.6 13 L 21.4 13 M 10.2 3.6 L 10.2 6.4 M 8.8 5 L 11.6 5",
    // eyedropper
    "M 3.4 20.6 L 4.4 16.4 L 12.4 8.4 L 15.6 11.6 L 7.6 19.6 Z M 10.8 6.8 L 17.2 13.2 M 14 7.6 L 16.6 4.9 B "
    "17.8 3.7 19.2 3.8 20.2 4.8 B 21.2 "
    "5.8 20.3 7.4 19.1 8.6 L 16.4 10.9",
    // move: arrows
    "M 12 3 L 12 21 M 3 12 L 21 12 M 9.4 5.6 L 12 3 L 14.6 5.6 M 9.4 18.4 L 12 21 L 14.6 18.4 M 5.6 9.4 L 3 "
    "12 L 5.6 14.6 M 18.4 9.4 L 21 12 L "
    "18.4 14.6",
    // rotate: a turning arrow
    "A 12 12.4 8.3 -50 235 M 17.7 10.3 L 17.3 6 L 21.6 6 D 12 12.4 1.6",
    // scale: a small square becomes a large one
    "M 3.5 13 L 11 13 L 11 20.5 L 3.5 20.5 Z M 3.5 9 L 3.5 3.5 L 20.5 3.5 L 20.5 20.5 L 15 20.5 M 13.2 10.8 "
    "L 17.2 6.8 M 13.4 6.8 L 17.2 6.8 L 17.2 "
    "10.6",
    // measure: a ruler
    "M 3.2 16 L 16 3.2 L 20.8 8 L 8 20.8 Z M 12.8 6.4 L 14.8 8.4 M 9.6 9.6 L 11.6 11.6 M 6.4 12.8 L 8.4 14.8",
    // level: up on a plane
    "M 2.8 19.5 L 8.2 14 L 21.2 14 L 15.8 19.5 Z M 12 16.8 L 12 3.8 M 8.8 7 L 12 3.8 L 15.2 7",
    // origin: axes
    "M 8.5 15.5 L 8.5 3.5 M 8.5 15.5 L 20.5 15.5 M 8.5 15.5 L 3.5 20.5 M 6 6 L 8.5 3.5 L 11 6 M 18 13 L 20.5 "
    "15.5 L 18 18 D 8.5 15.5 2.2",
    // open: a folder
    "M 3.2 19.2 L 3.2 4.8 L 9.2 4.8 L 11.2 7.3 L 19.2 7.3 L 19.2 10.6 M 3.2 19.2 L 6.2 10.6 L 21.6 10.6 L "
    "18.6 19.2 Z",
    // save: a floppy disk
    "M 4 4 L 16.4 4 L 20 7.6 L 20 20 L 4 20 Z M 7.8 4 L 7.8 9 L 15 9 L 15 4 M 7.2 20 L 7.2 13.4 L 16.8 13.4 "
    "L 16.8 20",
    // undo
    "M 8.4 4.4 L 3.8 9 L 8.4 13.6 M 3.8 9 L 14.4 9 B 17.9 9 20.4 11.3 20.4 14.4 B 20.4 17.5 17.9 19.8 14.4 "
    "19.8 L 9 19.8",
    // redo
    "M 15.6 4.4 L 20.2 9 L 15.6 13.6 M 20.2 9 L 9.6 9 B 6.1 9 3.6 11.3 3.6 14.4 B 3.6 17.5 6.1 19.8 9.6 19.8 "
    "L 15 19.8",
    // clean: a broom
    "M 20.6 3.4 L 13.6 10.4 M 10.8 9 L 15 13.2 M 10.8 9 B 8 10.6 5.4 11.6 3 12 L 12 21 B 12.4 18.6 13.4 16 "
    "15 13.2 M 6.2 15.2 L 9 12.9 M 9.1 18.1 L "
    "11.4 15.3",
    // film
    "M 3.5 5 L 20.5 5 L 20.5 19 L 3.5 19 Z M 7.8 5 L 7.8 19 M 16.2 5 L 16.2 19 M 3.5 9.7 L 7.8 9.7 M 3.5 "
    "14.3 L 7.8 14.3 M 16.2 9.7 L 20.5 9.7 M 16.2 "
    "14.3 L 20.5 14.3",
    // publish: out of a box
    "M 8 9.8 L 4.8 9.8 L 4.8 20.6 L 19.2 20.6 L 19.2 9.8 L 16 9.8 M 12 14.8 L 12 3 M 8.2 6.8 L 12 3 L 15.8 "
    "6.8",
    // picture: a camera
    "M 3 7.6 L 7.4 7.6 L 9.2 4.8 L 14.8 4.8 L 16.6 7.6 L 21 7.6 L 21 19.2 L 3 19.2 Z C 12 13.1 3.7",
    // help
    "C 12 12 8.9 M 9.3 9.6 B 9.3 8 10.4 7 12 7 B 13.6 7 14.7 8 14.7 9.4 B 14.7 11.5 12 11.6 12 14 D 12 16.9 "
    "1.1",
    // panel
    "M 3.2 4.8 L 20.8 4.8 L 20.8 19.2 L 3.2 19.2 Z M 10 4.8 L 10 19.2 M 5.8 8.6 L 7.4 8.6 M 5.8 12 L 7.4 12",
    // eye
    "M 2.6 12 B 5 7.7 8.2 5.6 12 5.6 B 15.8 5.6 19 7.7 21.4 12 B 19 16.3 15.8 18.4 12 18.4 B 8.2 18.4 5 16.3 "
    "2.6 12 Z C 12 12 3",
    // eye_off: closed, with lashes
    "M 2.6 9.5 B 5 13.6 8.2 15.6 12 15.6 B 15.8 15.6 19 13.6 21.4 9.5 M 12 15.6 L 12 19 M 7.2 14.5 L 5.6 "
    "17.4 M 16.8 14.5 L 18.4 17.4",
    // more
    "D 5.5 12 1.7 D 12 12 1.7 D 18.5 12 1.7",
    // drop: into a tray
    "M 3.6 14.6 L 3.6 20 L 20.4 20 L 20.4 14.6 M 12 3.4 L 12 15 M 7.6 10.6 L 12 15 L 16.4 10.6"};

/// Follows the words of a shape with a pen.
class Pen {
  public:
    Pen(ImDrawList& list, const ImVec2& center, float size, ImU32 color)
        : list_(list),
          unit_(size / kGrid),
          low_(center.x - size / 2, center.y - size / 2),
          thickness_(std::max(1.0f, kStroke * size / kGrid)),
          color_(color) {}

    void draw(std::string_view words) {
        words_ = words;
        for (std::string_view word = core::next_word(words_); !word.empty(); word = core::next_word(words_))
            obey(word.front());
        end(false);
    }

  private:
    float number() { return float(core::parse_number(core::next_word(words_)).value_or(0)); }
    ImVec2 point() {
        const float x = number(), y = number();
        return {low_.x + x * unit_, low_.y + y * unit_};
    }
    void obey(char command) {
        if (command == 'M' || command == 'A' || command == 'C' || command == 'D') end(false);
        if (command == 'Z') return end(true);
        const ImVec2 at = point();
        if (command == 'M' || command == 'L') return list_.PathLineTo(at);
        if (command == 'B') {
            const ImVec2 second = point(), last = point();
            return list_.PathBezierCubicCurveTo(at, second, last);
        }
        const float radius = number() * unit_;
        if (command == 'C') return list_.AddCircle(at, radius, color_, 0, thickness_);
        if (command == 'D') return list_.AddCircleFilled(at, radius, color_);
        constexpr float kDegree = std::numbers::pi_v<float> / 180;
        const float from = number() * kDegree, to = number() * kDegree;
        list_.PathArcTo(at, radius, from, to);
    }
    /// Draws the line, with round ends.
    void end(bool closed) {
        if (list_._Path.Size < 2) return list_.PathClear();
        const ImVec2 first = list_._Path.front(), last = list_._Path.back();
        list_.PathStroke(color_, closed ? ImDrawFlags_Closed : ImDrawFlags_None, thickness_);
        if (closed || (color_ >> IM_COL32_A_SHIFT) < 255) return;  // they would shine through each other
        list_.AddCircleFilled(first, thickness_ / 2, color_, 8);
        list_.AddCircleFilled(last, thickness_ / 2, color_, 8);
    }

    ImDrawList& list_;
    float unit_;
    ImVec2 low_;
    float thickness_;
    ImU32 color_;
    std::string_view words_;
};

}  // namespace

void draw_icon(Icon icon, const ImVec2& center, float size, unsigned color) {
    Pen(*ImGui::GetWindowDrawList(), center, size, color).draw(kShapes[size_t(icon)]);
}

bool icon_button(Icon icon, const char* tooltip, bool active, bool enabled, float side, const char* keys) {
    ImGui::PushID(int(icon));
    ImGui::BeginDisabled(!enabled);
    const bool clicked = ImGui::InvisibleButton("button", ImVec2(side, side));
    const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
    const bool hovered = ImGui::IsItemHovered();
    ImU32 back = active ? ImGui::GetColorU32(accent(0.16f)) : 0;
    if (hovered)
        back = ImGui::GetColorU32(ImGui::IsItemActive() ? ImGuiCol_ButtonActive : ImGuiCol_ButtonHovered);
    const float rounding = ImGui::GetStyle().FrameRounding;
    if (back) ImGui::GetWindowDrawList()->AddRectFilled(low, high, back, rounding);
    draw_icon(icon, {(low.x + high.x) / 2, (low.y + high.y) / 2}, kIconShare * side,
              active ? ImGui::GetColorU32(accent()) : ImGui::GetColorU32(ImGuiCol_Text));
    ImGui::EndDisabled();
    ImGui::PopID();
    ui::show_hint(tooltip, keys);
    return clicked && enabled;
}

}  // namespace ewa::viewer
