// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/timeline.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <glm/matrix.hpp>
#include <utility>

#include "core/text.h"
#include "viewer/editor/panel_controls.h"
#include "viewer/editor/texts.h"

namespace ewa::viewer {
namespace {

constexpr std::array kSpeeds{0.25f, 0.5f, 1.0f, 2.0f, 4.0f};
constexpr double kTickSteps[] = {0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600};

/// Continues the line if an item of this width fits there.
void fit_in_line(float width) {
    const float right = ImGui::GetWindowPos().x + ImGui::GetWindowContentRegionMax().x;
    if (ImGui::GetItemRectMax().x + ImGui::GetStyle().ItemSpacing.x + width <= right) ImGui::SameLine();
}

bool placed_button(const texts::Item& item, bool enabled = true) {
    fit_in_line(ImGui::CalcTextSize(item.name).x + 2 * ImGui::GetStyle().FramePadding.x);
    ImGui::BeginDisabled(!enabled);
    const bool clicked = ImGui::Button(item.name);
    ui::show_hint(item.hint);
    ImGui::EndDisabled();
    return clicked;
}

/// A label. The next item follows it, as wide as so many lines are high. begins: a line of its own.
void label_before(const char* text, float lines, bool begins = false) {
    const float gap = ImGui::GetStyle().ItemInnerSpacing.x, width = lines * ImGui::GetTextLineHeight();
    if (!begins) fit_in_line(ImGui::CalcTextSize(text).x + gap + width);
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(text);
    ImGui::SameLine(0, gap);
    ImGui::SetNextItemWidth(width);
}

void placed_checkbox(const char* text, bool& value) {
    fit_in_line(ImGui::GetFrameHeight() + ImGui::GetStyle().ItemInnerSpacing.x + ImGui::CalcTextSize(text).x);
    ImGui::Checkbox(text, &value);
}

void draw_diamond(const ImVec2& middle, float radius, ImU32 color) {
    ImGui::GetWindowDrawList()->AddQuadFilled({middle.x, middle.y - radius}, {middle.x + radius, middle.y},
                                              {middle.x, middle.y + radius}, {middle.x - radius, middle.y},
                                              color);
}

}  // namespace

double steady_now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

FilmStrip::FilmStrip(ViewState& state, Navigation& navigation, Shown& shown_renders, Dialogs& dialogs,
                     FileDialog& files)
    : state_(state), navigation_(navigation), shown_(shown_renders), dialogs_(dialogs), files_(files) {}

Rectangle FilmStrip::area_above() const {
    Rectangle area = state_.picture_area();
    const float scale = ImGui::GetIO().DisplayFramebufferScale.y;
    if (shown || writing()) area.height = std::max(1, area.height - int(height_ * scale));
    return area;
}

std::optional<size_t> FilmStrip::key_at_playhead() const {
    for (size_t i = 0; i < navigation_.views.size(); ++i)
        if (std::abs(navigation_.views[i].time.value_or(-1) - playhead_) < 1e-6) return i;
    return std::nullopt;
}

/// Shows the film's camera at this time. The pivot is ahead of the camera, as far as before.
void FilmStrip::show(double time) {
    playhead_ = std::clamp(time, *views().front().time, *views().back().time);
    const Camera camera = path().at(playhead_);
    const glm::dvec3 ahead = glm::transpose(camera.rotation)[2];
    const ViewCamera& view = navigation_.view;
    navigation_.stand({camera, camera.position() + ahead * view.distance(), view.up(), view.radius()});
    last_ = view.camera(camera.width, camera.height);
}

void FilmStrip::add_key() {
    shown = true;
    give_times(views(), distance());
    remember();
    const double time = time_for_key(views(), playhead_, distance());
    navigation_.add_view(time);
    give_times(views(), distance());
    playhead_ = time;
}

void FilmStrip::replace_key() {
    const auto key = key_at_playhead();
    if (!key) return;
    remember();
    io::NamedView& view = views()[*key];
    const io::NamedView now = navigation_.here();
    view.camera = now.camera;
    view.pivot = now.pivot;
}

void FilmStrip::forget_key() {
    const auto key = key_at_playhead();
    if (!key) return;
    remember();
    views().erase(views().begin() + std::ptrdiff_t(*key));
}

void FilmStrip::play(bool on) {
    playing_ = on && views().size() >= 2;
    if (!playing_) return;
    give_times(views(), distance());
    show(playhead_ >= *views().back().time ? 0 : playhead_);
}

void FilmStrip::advance(double seconds) {
    // A screenshot waits for the full frame of a view that stays.
    if (!playing_ || state_.loop.capture) return;
    const Camera now = navigation_.view.camera(last_.width, last_.height);
    if (views().size() < 2 || now.rotation != last_.rotation || now.translation != last_.translation)
        return play(false);  // the user moves the camera
    const double first = *views().front().time, end = *views().back().time;
    // A window that has slept for long continues where it was.
    double time = playhead_ + std::min(seconds, 0.5) * double(speed_);
    if (time > end && loop_) time = first + std::fmod(time - first, end - first);
    if (time >= end && !loop_) playing_ = false;
    show(time);
}

bool FilmStrip::handle_key(const KeyPress& press) {
    if (press.shift) return false;
    if (press.control && press.key == GLFW_KEY_K && !views().empty() && !writing()) open_film();
    if (press.control) return press.key == GLFW_KEY_K;
    if (press.key == GLFW_KEY_K) add_key();
    if (press.key == GLFW_KEY_SPACE && shown) play(!playing_);
    return press.key == GLFW_KEY_K || (press.key == GLFW_KEY_SPACE && shown);
}

void FilmStrip::draw() {
    if (!shown && !writing()) return;
    const Rectangle area = state_.picture_area();
    const ImVec2 scale = ImGui::GetIO().DisplayFramebufferScale;
    const float left = float(area.x) / scale.x, width = float(area.width) / scale.x;
    const float height = float(area.height) / scale.y, bottom = float(area.y) / scale.y + height;
    ImGui::SetNextWindowPos(ImVec2(left, bottom), ImGuiCond_Always, ImVec2(0, 1));
    ImGui::SetNextWindowSize(ImVec2(width, 0));
    // In a low window the rows scroll.
    ImGui::SetNextWindowSizeConstraints(ImVec2(width, 0), ImVec2(width, 0.6f * height));
    constexpr auto kFlags = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize |
                            ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse |
                            ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing;
    if (ImGui::Begin("film strip", nullptr, kFlags)) {
        if (writing()) draw_progress();
        if (shown) {
            // Without a time, views are still in the order in which they were saved.
            give_times(views(), distance());
            if (!views().empty())
                playhead_ = std::clamp(playhead_, *views().front().time, *views().back().time);
            draw_track();
            draw_buttons();
            draw_settings();
        }
    }
    height_ = ImGui::GetWindowHeight();
    ImGui::End();
}

void FilmStrip::draw_progress() {
    const double now = steady_now();
    std::array<char, 96> text{};
    std::snprintf(text.data(), text.size(), texts::film::kProgress, writer_->written(), writer_->frames());
    std::string line = writer_->ending() ? texts::film::kEnding : text.data();
    if (const auto left = writer_->left(now); left && !writer_->ending())
        line += ", " + core::duration_text(*left) + " left";
    const float button =
        ImGui::CalcTextSize(texts::film::kStop.name).x + 4 * ImGui::GetStyle().FramePadding.x;
    ImGui::ProgressBar(float(writer_->written()) / float(writer_->frames()), ImVec2(-button, 0),
                       line.c_str());
    ImGui::SameLine();
    ImGui::BeginDisabled(writer_->ending());
    ImGui::PushID("writing");
    if (ImGui::Button(texts::film::kStop.name)) stop_film();
    ImGui::PopID();
    ImGui::EndDisabled();
}

/// Drags keys; elsewhere, the playhead.
void FilmStrip::use_mouse(const Scale& scale) {
    const float x = ImGui::GetIO().MousePos.x;
    if (ImGui::IsItemActivated()) {
        play(false);
        dragged_.reset();
        moved_ = false;
        float least = 0.5f * ImGui::GetTextLineHeight();
        for (size_t i = 0; i < views().size(); ++i) {
            const float away = std::abs(scale.at(*views()[i].time) - x);
            if (away >= least) continue;
            least = away;
            dragged_ = i;
        }
        if (dragged_) navigation_.go_to(views()[*dragged_]);
        if (dragged_) playhead_ = *views()[*dragged_].time;
    }
    if (!ImGui::IsItemActive() || views().empty()) return;
    const double time = std::clamp(scale.time(x), 0.0, scale.range);
    if (!dragged_) return show(time);
    if (!ImGui::IsMouseDragging(ImGuiMouseButton_Left, kStillPixels)) return;
    if (!std::exchange(moved_, true)) remember();
    dragged_ = move_key(views(), *dragged_, time);
    playhead_ = *views()[*dragged_].time;
}

void FilmStrip::draw_track() {
    const float line = ImGui::GetTextLineHeight();
    const ImVec2 at = ImGui::GetCursorScreenPos();
    const float width = std::max(4 * line, ImGui::GetContentRegionAvail().x), height = 2.6f * line;
    ImGui::InvisibleButton("track", ImVec2(width, height));
    // The scale stays while a key is dragged.
    const double end = views().empty() ? 0 : *views().back().time;
    if (!ImGui::IsItemActive() || range_ == 0) range_ = std::max(1.1 * end, distance());
    const Scale scale{at.x + line, width - 2 * line, range_};
    use_mouse(scale);

    ImDrawList& list = *ImGui::GetWindowDrawList();
    const ImU32 quiet = ImGui::GetColorU32(ImGuiCol_TextDisabled), text = ImGui::GetColorU32(ImGuiCol_Text);
    const float middle = at.y + 1.8f * line, bottom = at.y + height;
    list.AddRectFilled({at.x, at.y + line}, {at.x + width, bottom}, ImGui::GetColorU32(ImGuiCol_FrameBg),
                       ImGui::GetStyle().FrameRounding);
    double step = kTickSteps[0];
    for (const double longer : kTickSteps)
        if (scale.at(step) - scale.at(0) < 4 * line) step = longer;
    for (int i = 0; i * step <= range_; ++i) {
        std::array<char, 32> label{};
        std::snprintf(label.data(), label.size(), step < 1 ? "%.1f s" : "%.0f s", i * step);
        const float x = scale.at(i * step);
        list.AddLine({x, at.y + line}, {x, bottom}, ImGui::GetColorU32(ImGuiCol_Separator));
        const float last = at.x + width - ImGui::CalcTextSize(label.data()).x;
        list.AddText({std::min(x, last), at.y}, quiet, label.data());
    }
    if (views().empty()) {
        list.AddText({scale.left, middle - 0.5f * line}, quiet, texts::film::kEmpty);
        return;
    }
    list.AddLine({scale.at(*views().front().time), middle}, {scale.at(end), middle}, quiet,
                 std::max(1.0f, 0.1f * line));
    const auto chosen = key_at_playhead();
    for (size_t i = 0; i < views().size(); ++i)
        draw_diamond({scale.at(*views()[i].time), middle}, 0.45f * line,
                     ImGui::GetColorU32(chosen == i ? ImGuiCol_CheckMark : ImGuiCol_TextDisabled));
    const float x = scale.at(playhead_);
    list.AddLine({x, at.y + line}, {x, bottom}, text, std::max(1.0f, 0.1f * line));
}

void FilmStrip::draw_buttons() {
    const bool several = views().size() >= 2, on_key = key_at_playhead().has_value();
    if (placed_button(playing_ ? texts::film::kStop : texts::film::kPlay, several)) play(!playing_);
    if (placed_button(texts::film::kAdd)) add_key();
    if (placed_button(texts::film::kReplace, on_key)) replace_key();
    if (placed_button(texts::film::kDelete, on_key)) forget_key();
    if (placed_button(texts::film::kEven, several)) {
        remember();
        space_evenly(views());
    }
    if (placed_button(texts::film::kSaveFilm, !views().empty() && !writing())) open_film();
    if (placed_button(texts::film::kSaveKeys, !views().empty())) navigation_.write_views();
    if (placed_button(texts::film::kSavePicture)) open_picture();
}

void FilmStrip::draw_settings() {
    const auto name = [](float speed) {
        std::array<char, 16> text{};
        std::snprintf(text.data(), text.size(), "%gx", double(speed));
        return std::string(text.data());
    };
    label_before(texts::film::kSpeed, 4.5f, true);
    if (ImGui::BeginCombo("##speed", name(speed_).c_str())) {
        for (const float speed : kSpeeds)
            if (ImGui::Selectable(name(speed).c_str(), speed == speed_)) speed_ = speed;
        ImGui::EndCombo();
    }
    placed_checkbox(texts::film::kLoop, loop_);
    placed_checkbox(texts::film::kSmooth, smooth_);
    if (views().size() >= 2) {
        float length = float(*views().back().time - *views().front().time);
        label_before(texts::film::kLength, 6);
        const bool changed =
            ImGui::DragFloat("##length", &length, 0.05f, 0.2f, 3600, "%.2f s", ImGuiSliderFlags_AlwaysClamp);
        if (ImGui::IsItemActivated()) remember();
        if (changed) stretch(views(), double(length));
    }
    label_before(texts::film::kDistance, 6);
    ImGui::SliderFloat("##distance", &state_.settings.film_seconds, 0.2f, 10, "%.1f s",
                       ImGuiSliderFlags_AlwaysClamp);
    const ImVec2 padding = ImGui::GetStyle().FramePadding;
    const float width = ImGui::CalcTextSize(texts::film::kHide.name).x + 2 * padding.x;
    fit_in_line(width);
    ImGui::SetCursorPosX(ImGui::GetWindowContentRegionMax().x - width);
    if (ImGui::Button(texts::film::kHide.name)) shown = false;
    ui::show_hint(texts::film::kHide.hint);
}

}  // namespace ewa::viewer
