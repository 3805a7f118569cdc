// SPDX-License-Identifier: Apache-2.0
#include "viewer/overlay.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <vector>

#include "core/text.h"
#include "scene/frustum.h"
#include "viewer/editor/theme.h"

namespace ewa::viewer {
namespace {

constexpr ImU32 kCameraColor = IM_COL32(90, 200, 255, 150), kPointedColor = IM_COL32(255, 210, 60, 255);
constexpr ImU32 kTextColor = IM_COL32(255, 255, 255, 255), kShadowColor = IM_COL32(0, 0, 0, 190);
constexpr float kGrab = 12;      // px around a target that count as on it
constexpr double kFar = 100000;  // px; line ends are clamped to this

void label(ImDrawList& list, const ImVec2& at, const char* text) {
    const ImVec2 size = ImGui::CalcTextSize(text);
    list.AddRectFilled({at.x - 4, at.y - 2}, {at.x + size.x + 4, at.y + size.y + 2}, kShadowColor, 3);
    list.AddText(at, kTextColor, text);
}

/// A knob with a triangle on each side.
void grip(ImDrawList& list, const ImVec2& at, float radius) {
    list.AddCircleFilled(at, radius, kShadowColor);
    list.AddCircle(at, radius, kTextColor, 0, 1.5f);
    for (const float side : {-1.0f, 1.0f}) {
        const float tip = at.x + side * 0.75f * radius, foot = at.x + side * 0.3f * radius;
        list.AddTriangleFilled({tip, at.y}, {foot, at.y - 0.35f * radius}, {foot, at.y + 0.35f * radius},
                               kTextColor);
    }
}

/// The frame whose camera is under the pointer.
std::optional<int> pointed_at(const std::vector<Frame>& frames, const Camera& view, const Rectangle& place,
                              std::optional<int> at_camera) {
    if (ImGui::GetIO().WantCaptureMouse) return std::nullopt;
    const ImVec2 mouse = ImGui::GetIO().MousePos;
    std::optional<int> nearest;
    float least = kGrab;
    for (size_t i = 0; i < frames.size(); ++i) {
        if (int(i) == at_camera) continue;
        const auto pixel = projected(frames[i].camera.position(), view);
        if (!pixel) continue;
        const ImVec2 at = gui_point(pixel->x + place.x, pixel->y + place.y);
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

/// Draws lines in a window without input, centred in the area. at: its place in the area, from 0 (top) to 1.
/// raise: how far it is moved up, in ImGui's coordinates.
void draw_message(const char* name, const std::string& text, const Rectangle& area, float at, float raise) {
    const ImVec2 low = gui_point(area.x, area.y), high = gui_point(area.x + area.width, area.y + area.height);
    const float line = ImGui::GetTextLineHeight(), room = std::max(line, high.x - low.x - 2 * line);
    const float width = std::min({room, 40 * line, ImGui::CalcTextSize(text.c_str()).x + 2});
    ImGui::SetNextWindowPos(ImVec2((low.x + high.x) / 2, low.y + (high.y - low.y) * at - raise),
                            ImGuiCond_Always, ImVec2(0.5f, at));
    ImGui::SetNextWindowBgAlpha(0.8f * ImGui::GetStyle().Alpha);
    constexpr auto kFlags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize |
                            ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoFocusOnAppearing |
                            ImGuiWindowFlags_NoNav | ImGuiWindowFlags_NoSavedSettings;
    if (ImGui::Begin(name, nullptr, kFlags)) {
        ImGui::PushTextWrapPos(ImGui::GetCursorPosX() + width);
        ImGui::TextUnformatted(text.c_str());
        ImGui::PopTextWrapPos();
    }
    ImGui::End();
}

/// A line in the middle of the area, wrapped, whose upper border is at y. Returns the lower border.
float centered_text(ImDrawList& list, ImFont* font, float size, ImU32 color, const std::string& text,
                    const ImVec2& low, const ImVec2& high, float y) {
    const float width = std::max(1.0f, (high.x - low.x) * 0.9f);
    const ImVec2 extent = font->CalcTextSizeA(size, FLT_MAX, width, text.c_str());
    list.AddText(font, size, ImVec2((low.x + high.x - extent.x) / 2, y), color, text.c_str(), nullptr, width);
    return y + extent.y;
}

}  // namespace

ImVec2 gui_point(double x, double y) {
    const ImVec2 scale = ImGui::GetIO().DisplayFramebufferScale;
    return {float(std::clamp(x, -kFar, kFar)) / std::max(scale.x, 1e-3f),
            float(std::clamp(y, -kFar, kFar)) / std::max(scale.y, 1e-3f)};
}

bool begin_card(const char* name, const Rectangle& area, float at) {
    const ImVec2 low = gui_point(area.x, area.y), high = gui_point(area.x + area.width, area.y + area.height);
    ImGui::SetNextWindowPos(ImVec2((low.x + high.x) / 2, low.y + (high.y - low.y) * at), ImGuiCond_Always,
                            ImVec2(0.5f, 0.5f));
    return ImGui::Begin(name, nullptr,
                        ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize |
                            ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                            ImGuiWindowFlags_NoFocusOnAppearing);
}

std::optional<int> draw_cameras(const OpenedScene& scene, const Camera& view, const Rectangle& place,
                                double size, std::optional<int> at_camera) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.PushClipRect(gui_point(place.x, place.y), gui_point(place.x + place.width, place.y + place.height));
    const std::vector<Frame>& frames = scene.dataset->frames;
    const std::optional<int> pointed = pointed_at(frames, view, place, at_camera);
    for (size_t i = 0; i < frames.size(); ++i) {
        if (int(i) == at_camera) continue;
        const bool here = int(i) == pointed;
        for (const Segment& segment : frustum_segments(frames[i].camera, size)) {
            const auto line = projected(segment, view);
            if (!line) continue;
            list.AddLine(gui_point((*line)[0].x + place.x, (*line)[0].y + place.y),
                         gui_point((*line)[1].x + place.x, (*line)[1].y + place.y),
                         here ? kPointedColor : kCameraColor, here ? 2.0f : 1.0f);
        }
    }
    list.PopClipRect();
    if (pointed) {
        const ImVec2 mouse = ImGui::GetIO().MousePos;
        std::string text = frames[size_t(*pointed)].name;
        if (!scene.supports.empty())
            text += "\n" + support_text(*scene.dataset, scene.supports[size_t(*pointed)]);
        label(*ImGui::GetForegroundDrawList(), {mouse.x + 14, mouse.y + 10}, text.c_str());
    }
    return pointed;
}

void draw_measurement(const Measurement& measurement, const Camera& view, const Rectangle& place) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.PushClipRect(gui_point(place.x, place.y), gui_point(place.x + place.width, place.y + place.height));
    const auto on_screen = [&](const glm::dvec2& pixel) {
        return gui_point(pixel.x + place.x, pixel.y + place.y);
    };
    constexpr float kMark = 5;
    if (measurement.complete())
        if (const auto line = projected(Segment{measurement.points[0], measurement.points[1]}, view)) {
            const ImVec2 a = on_screen((*line)[0]), b = on_screen((*line)[1]);
            list.AddLine(a, b, kPointedColor, 2);
            label(list, {(a.x + b.x) / 2 + 2 * kMark, (a.y + b.y) / 2}, measurement.label().c_str());
        }
    for (const glm::dvec3& point : measurement.points)
        if (const auto pixel = projected(point, view)) {
            list.AddCircle(on_screen(*pixel), kMark + 1, kShadowColor, 0, 3);
            list.AddCircle(on_screen(*pixel), kMark, kPointedColor, 0, 2);
        }
    list.PopClipRect();
}

void draw_comparison(Comparison comparison, const Arrangement& arrangement, float wipe) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const Rectangle &image = arrangement.image, &rendering = arrangement.rendering;
    const float line = ImGui::GetTextLineHeight();
    const auto foot = [&](const Rectangle& place, const char* text, float share) {
        const ImVec2 low = gui_point(place.x + place.width * double(share), place.y + place.height);
        label(list, {low.x - ImGui::CalcTextSize(text).x / 2, low.y - 2 * line}, text);
    };
    if (comparison == Comparison::beside) {
        foot(fitted(image.size(), rendering), "splats", 0.5f);
        foot(image, "image", 0.5f);
    } else if (comparison == Comparison::wipe) {
        const float x = wipe_position(image, wipe);
        list.AddLine({x, gui_point(0, image.y).y}, {x, gui_point(0, image.y + image.height).y},
                     IM_COL32(255, 255, 255, 220), 2);
        grip(list, {x, gui_point(0, image.y + image.height / 2.0).y}, line);
        if (wipe > 0.15f) foot(image, "image", wipe / 2);
        if (wipe < 0.85f) foot(image, "splats", (1 + wipe) / 2);
    } else if (comparison == Comparison::difference) {
        foot(image, "difference to the image", 0.5f);
    }
}

bool over_wipe(const Rectangle& image, float wipe) {
    return std::abs(ImGui::GetIO().MousePos.x - wipe_position(image, wipe)) < kGrab;
}

void draw_note(const std::string& note, const Rectangle& area) {
    draw_message("note", note, area, 1, 5.5f * ImGui::GetTextLineHeight());
}

void draw_hint(const Hint& hint, const Rectangle& area) {
    std::vector<std::string> keys{"drag: turn", "right drag: move", "wheel: closer", "double click: look at",
                                  "F: whole scene"};
    keys.insert(keys.end(), {hint.images ? "V: compare with the images" : "W A S D: fly", "F1: all keys"});
    if (!hint.panel) keys.push_back("F2: panel");
    std::string text;
    for (const std::string& key : keys) {
        if (!text.empty()) text += "    ";
        for (const char c : key)
            text += c == ' ' ? std::string("\u00a0") : std::string(1, c);  // it stays together
    }
    // Above the labels of the compared images.
    ImGui::PushStyleVar(ImGuiStyleVar_Alpha, hint.opacity);
    draw_message("hint", text, area, 1, (hint.comparing ? 3 : 0.5f) * ImGui::GetTextLineHeight());
    ImGui::PopStyleVar();
}

void draw_banner(const std::string& text, const Rectangle& area) {
    draw_message("banner", text, area, 0, -ImGui::GetTextLineHeight());
}

void draw_headline(const Headline& headline, const Rectangle& area) {
    const ImVec2 low = gui_point(area.x, area.y), high = gui_point(area.x + area.width, area.y + area.height);
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.AddRectFilled(low, high, backdrop());
    const bool dark = (backdrop() & 255) < 128;
    ImFont* large = ImGui::GetIO().Fonts->Fonts.back();  // as Gui adds them
    const float line = ImGui::GetTextLineHeight();
    const float below = centered_text(list, large, 2 * line, dark ? kTextColor : IM_COL32_BLACK,
                                      headline.text, low, high, low.y + (high.y - low.y) * 0.4f);
    centered_text(list, ImGui::GetFont(), line, ImGui::GetColorU32(ImGuiCol_TextDisabled),
                  headline.explanation, low, high, below + line);
}

bool draw_search(const CaptureProgress& progress, const Rectangle& area) {
    bool stop = false;
    if (begin_card("search", area, 0.5f)) {
        ImGui::TextUnformatted("finding the cameras of the photos");
        std::string text = "looking at them ...";
        if (progress.total > 0)
            text = progress.what + " " + std::to_string(progress.done) + " of " +
                   std::to_string(progress.total) + " " + progress.unit;
        if (progress.left >= 0) text += ", about " + core::duration_text(progress.left) + " left";
        ImGui::TextUnformatted(text.c_str());
        const float line = ImGui::GetTextLineHeight();
        ImGui::ProgressBar(float(progress.done) / float(std::max(1, progress.total)),
                           ImVec2(16 * line, 0.4f * line), "");
        if (!progress.note.empty()) {
            ImGui::PushTextWrapPos(16 * line);
            ImGui::TextUnformatted(progress.note.c_str());
            ImGui::PopTextWrapPos();
        }
        stop = ImGui::Button("Stop");
        ImGui::SameLine();
        ImGui::TextDisabled("Esc; what is done is kept");
    }
    ImGui::End();
    return stop;
}

}  // namespace ewa::viewer
