// SPDX-License-Identifier: Apache-2.0
#include "viewer/overlay.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "scene/camera.h"

namespace ewa::viewer {
namespace {

constexpr ImU32 kCameraColor = IM_COL32(90, 200, 255, 150), kPointedColor = IM_COL32(255, 210, 60, 255);
constexpr ImU32 kTextColor = IM_COL32(255, 255, 255, 255), kShadowColor = IM_COL32(0, 0, 0, 190);
constexpr float kGrab = 12;      // px around a target that count as on it
constexpr double kFar = 100000;  // px; line ends are clamped to this

/// Converts framebuffer pixels to ImGui's coordinates.
ImVec2 gui_point(double x, double y) {
    const ImVec2 scale = ImGui::GetIO().DisplayFramebufferScale;
    return {float(std::clamp(x, -kFar, kFar)) / std::max(scale.x, 1e-3f),
            float(std::clamp(y, -kFar, kFar)) / std::max(scale.y, 1e-3f)};
}

void label(ImDrawList& list, const ImVec2& at, const char* text) {
    const ImVec2 size = ImGui::CalcTextSize(text);
    list.AddRectFilled({at.x - 4, at.y - 2}, {at.x + size.x + 4, at.y + size.y + 2}, kShadowColor, 3);
    list.AddText(at, kTextColor, text);
}

/// A knob with an arrow on each side.
void grip(ImDrawList& list, const ImVec2& at, float radius) {
    list.AddCircleFilled(at, radius, kShadowColor);
    list.AddCircle(at, radius, kTextColor, 0, 1.5f);
    for (const float side : {-1.0f, 1.0f}) {
        const float tip = at.x + side * 0.75f * radius, foot = at.x + side * 0.3f * radius;
        list.AddTriangleFilled({tip, at.y}, {foot, at.y - 0.35f * radius}, {foot, at.y + 0.35f * radius},
                               kTextColor);
    }
}

std::optional<int> pointed_at(const CamerasShown& cameras) {
    if (ImGui::GetIO().WantCaptureMouse) return std::nullopt;
    const ImVec2 mouse = ImGui::GetIO().MousePos;
    std::optional<int> nearest;
    float least = kGrab;
    for (size_t i = 0; i < cameras.dataset.frames.size(); ++i) {
        if (int(i) == cameras.at_camera) continue;
        const auto pixel = projected(cameras.dataset.frames[i].camera.position(), cameras.view);
        if (!pixel) continue;
        const ImVec2 at = gui_point(pixel->x + cameras.place.x, pixel->y + cameras.place.y);
        const float distance = std::hypot(at.x - mouse.x, at.y - mouse.y);
        if (!(distance < least)) continue;
        least = distance;
        nearest = int(i);
    }
    return nearest;
}

float wipe_position(const Rectangle& image, float wipe) {
    return gui_point(image.x + double(wipe) * image.width, 0).x;
}

/// Begins a centred window without input whose lower border is at y. End it with ImGui::End().
void begin_message(const char* name, float y) {
    ImGui::SetNextWindowPos(ImVec2(ImGui::GetIO().DisplaySize.x / 2, y), ImGuiCond_Always,
                            ImVec2(0.5f, 1.0f));
    ImGui::SetNextWindowBgAlpha(0.75f);
    constexpr auto kFlags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize |
                            ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoFocusOnAppearing |
                            ImGuiWindowFlags_NoNav;
    ImGui::Begin(name, nullptr, kFlags);
}

}  // namespace

std::optional<int> draw_cameras(const CamerasShown& cameras) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const Rectangle& place = cameras.place;
    list.PushClipRect(gui_point(place.x, place.y), gui_point(place.x + place.width, place.y + place.height));
    const std::optional<int> pointed = pointed_at(cameras);
    for (size_t i = 0; i < cameras.dataset.frames.size(); ++i) {
        if (int(i) == cameras.at_camera) continue;
        const bool here = int(i) == pointed;
        for (const Segment& segment : frustum_segments(cameras.dataset.frames[i].camera, cameras.size)) {
            const auto line = projected(segment, cameras.view);
            if (!line) continue;
            list.AddLine(gui_point((*line)[0].x + place.x, (*line)[0].y + place.y),
                         gui_point((*line)[1].x + place.x, (*line)[1].y + place.y),
                         here ? kPointedColor : kCameraColor, here ? 2.0f : 1.0f);
        }
    }
    list.PopClipRect();
    if (pointed) {
        const ImVec2 mouse = ImGui::GetIO().MousePos;
        label(*ImGui::GetForegroundDrawList(), {mouse.x + 14, mouse.y + 10},
              cameras.dataset.frames[size_t(*pointed)].name.c_str());
    }
    return pointed;
}

void draw_comparison(Comparison comparison, const Arrangement& arrangement, float wipe) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const Rectangle &photo = arrangement.image, &rendering = arrangement.rendering;
    const float line = ImGui::GetTextLineHeight();
    const auto foot = [&](const Rectangle& place, const char* text, float share) {
        const ImVec2 low = gui_point(place.x + place.width * double(share), place.y + place.height);
        label(list, {low.x - ImGui::CalcTextSize(text).x / 2, low.y - 2 * line}, text);
    };
    if (comparison == Comparison::beside) {
        foot(fitted({photo.width, photo.height}, rendering), "splats", 0.5f);
        foot(photo, "image", 0.5f);
    } else if (comparison == Comparison::wipe) {
        const float x = wipe_position(photo, wipe);
        list.AddLine({x, gui_point(0, photo.y).y}, {x, gui_point(0, photo.y + photo.height).y},
                     IM_COL32(255, 255, 255, 220), 2);
        grip(list, {x, gui_point(0, photo.y + photo.height / 2.0).y}, line);
        if (wipe > 0.15f) foot(photo, "image", wipe / 2);
        if (wipe < 0.85f) foot(photo, "splats", (1 + wipe) / 2);
    } else if (comparison == Comparison::difference) {
        foot(photo, "difference to the image", 0.5f);
    }
}

bool over_wipe(const Rectangle& image, float wipe) {
    return std::abs(ImGui::GetIO().MousePos.x - wipe_position(image, wipe)) < kGrab;
}

void draw_note(const std::string& note) {
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    const float line = ImGui::GetTextLineHeight();
    float width = std::min(size.x - 2 * line, 40 * line);
    width = std::min(std::max(width, line), ImGui::CalcTextSize(note.c_str()).x + 2);
    begin_message("note", size.y - 7 * line);
    ImGui::PushTextWrapPos(ImGui::GetCursorPosX() + width);
    ImGui::TextUnformatted(note.c_str());
    ImGui::PopTextWrapPos();
    ImGui::End();
}

void draw_hint(bool images) {
    // Above the labels of the compared images.
    begin_message("hint", ImGui::GetIO().DisplaySize.y - 3 * ImGui::GetTextLineHeight());
    ImGui::TextUnformatted("drag: turn    right drag: move    wheel: closer    double click: look at");
    ImGui::TextUnformatted(images ? "2: depth    V: compare with the images    F1: all keys"
                                  : "2: depth    W A S D: fly    F1: all keys");
    ImGui::End();
}

}  // namespace ewa::viewer
