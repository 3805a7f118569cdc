// SPDX-License-Identifier: Apache-2.0
#include "viewer/panel.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "viewer/training.h"

namespace ewa::viewer {
namespace {

struct Axis {
    const char* name;
    glm::dvec3 axis;
};
const std::array kAxes{Axis{"-y", {0, -1, 0}}, Axis{"+y", {0, 1, 0}}, Axis{"+z", {0, 0, 1}},
                       Axis{"-z", {0, 0, -1}}, Axis{"+x", {1, 0, 0}}, Axis{"-x", {-1, 0, 0}}};

void show_facts(const PanelFacts& facts) {
    ImGui::TextUnformatted(facts.title.c_str());
    if (!facts.picture) {
        ImGui::Text("%zu splats", facts.splats);
        return;
    }
    const RenderedFrame& shown = *facts.picture;
    ImGui::Text("%zu splats, %u visible", facts.splats, shown.splats_drawn);
    ImGui::Text("%d x %d px in %.1f ms%s", shown.picture.width, shown.picture.height, shown.milliseconds,
                facts.drawing ? "  ..." : "");
    if (shown.skipped_nonfinite > 0)
        ImGui::Text("%u splats are not finite and are skipped", shown.skipped_nonfinite);
}

void edit_look(const PanelFacts& facts, Look& look) {
    int mode = int(look.mode);
    if (ImGui::Combo("mode", &mode, "colour\0depth\0opacity\0splats per pixel\0ellipsoids\0"))
        look.mode = Mode(mode);
    if (facts.picture && facts.picture->request.look.mode == look.mode) {
        if (look.mode == Mode::depth)
            ImGui::Text("dark to white: depth %.4g to %.4g", double(facts.picture->picture.dark),
                        double(facts.picture->picture.white));
        if (look.mode == Mode::count)
            ImGui::Text("red, yellow, white: up to %.0f splats", double(facts.picture->picture.white));
    }
    if (look.mode == Mode::color || look.mode == Mode::ellipsoids)
        ImGui::ColorEdit3("background", look.background.data(), ImGuiColorEditFlags_NoInputs);
    ImGui::SliderFloat("splat scale", &look.splat_scale, 0.05f, 2.0f, "%.2f", ImGuiSliderFlags_AlwaysClamp);
    if (facts.scene_sh_degree > 0) {
        look.sh_degree = std::min(look.sh_degree, facts.scene_sh_degree);
        ImGui::SliderInt("SH degree", &look.sh_degree, 0, facts.scene_sh_degree, "%d",
                         ImGuiSliderFlags_AlwaysClamp);
    }
    int kernel = int(look.kernel);
    if (ImGui::Combo("kernel", &kernel, "peak (3DGS)\0antialias\0unit mass (EWA)\0"))
        look.kernel = Footprint(kernel);
}

void choose_up(const PanelFacts& facts, PanelActions& actions) {
    const char* present = "from cameras";
    for (const Axis& choice : kAxes)
        if (choice.axis == facts.up) present = choice.name;
    if (!ImGui::BeginCombo("up", present)) return;
    for (const Axis& choice : kAxes)
        if (ImGui::Selectable(choice.name, choice.name == present)) actions.up = choice.axis;
    ImGui::EndCombo();
}

void edit_cameras(const PanelFacts& facts, PanelSettings& settings, PanelActions& actions) {
    const int last = int(facts.dataset->frames.size()) - 1;
    int frame = facts.at_camera.value_or(0);
    if (ImGui::SliderInt("camera", &frame, 0, last, facts.at_camera ? "%d" : "-",
                         ImGuiSliderFlags_AlwaysClamp))
        actions.frame = frame;
    if (facts.at_camera)
        ImGui::TextDisabled("%s", facts.dataset->frames[size_t(*facts.at_camera)].name.c_str());
    ImGui::Checkbox("show cameras", &settings.cameras);
    int comparison = int(settings.comparison);
    if (ImGui::Combo("compare", &comparison, "none\0beside\0wipe\0difference\0"))
        settings.comparison = Comparison(comparison);
    if (settings.comparison == Comparison::wipe)
        ImGui::SliderFloat("wipe", &settings.wipe, 0, 1, "%.2f", ImGuiSliderFlags_AlwaysClamp);
    if (settings.comparison == Comparison::difference)
        ImGui::SliderFloat("gain", &settings.gain, 1, 16, "%.0f", ImGuiSliderFlags_AlwaysClamp);
    if (settings.comparison == Comparison::none) return;
    if (!facts.image_failure.empty())
        ImGui::TextWrapped("%s", facts.image_failure.c_str());
    else if (!facts.at_camera)
        ImGui::TextDisabled("G: go to the nearest camera");
    else if (facts.psnr && std::isfinite(*facts.psnr))
        ImGui::Text("PSNR of this view %.2f dB", *facts.psnr);
}

void edit_views(const PanelFacts& facts, PanelSettings& settings, PanelActions& actions) {
    if (ImGui::Button("Save this view")) actions.save_view = true;
    for (size_t i = 0; i < facts.views->size(); ++i) {
        ImGui::PushID(int(i));
        if (ImGui::Button((*facts.views)[i].name.c_str())) actions.view = i;
        ImGui::SameLine();
        if (ImGui::SmallButton("x")) actions.forget = i;
        ImGui::PopID();
    }
    if (facts.views->empty()) return;
    if (ImGui::Button("Write to a file")) actions.write_views = true;
    if (facts.views->size() < 2) return;
    ImGui::SliderFloat("s per view", &settings.film_seconds, 0.2f, 10, "%.1f", ImGuiSliderFlags_AlwaysClamp);
    if (facts.film_frame >= 0) {
        ImGui::ProgressBar(float(facts.film_frame) / float(std::max(1, facts.film_frames)));
        actions.stop_film = ImGui::Button("Stop film");
    } else {
        actions.film = ImGui::Button("Write film");
    }
}

void show_details(const PanelFacts& facts) {
    if (facts.picture && ImGui::CollapsingHeader("Time")) {
        for (const PassTime& time : facts.picture->pass_times)
            if (time.milliseconds >= 0.005)
                ImGui::Text("%-18s %8.2f ms", time.pass.c_str(), time.milliseconds);
        ImGui::Text("%-18s %8.2f ms", "request to frame", facts.picture->milliseconds);
        if (facts.pictures_a_second > 0)
            ImGui::Text("%-18s %8.1f", "moving, per second", facts.pictures_a_second);
        if (facts.first_picture) ImGui::Text("%-18s %8.0f ms", "first frame", 1000 * *facts.first_picture);
    }
    if (facts.plan && ImGui::CollapsingHeader("Skipped work")) {
        for (const PlanLine& line : *facts.plan) {
            ImGui::BulletText("%s", line.what.c_str());
            if (line.bytes_saved > 0)
                ImGui::TextDisabled("    saves %.1f MiB", double(line.bytes_saved) / (1 << 20));
        }
    }
    if (facts.picture && ImGui::CollapsingHeader("Memory and device")) {
        ImGui::Text("%.1f MiB on the device", double(facts.picture->device_bytes) / (1 << 20));
        ImGui::TextWrapped("%s", facts.device.c_str());
    }
}

}  // namespace

glm::dvec3 next_up(const glm::dvec3& up) {
    for (size_t i = 0; i < kAxes.size(); ++i)
        if (kAxes[i].axis == up) return kAxes[(i + 1) % kAxes.size()].axis;
    return kAxes[0].axis;
}

PanelActions draw_panel(const PanelFacts& facts, PanelSettings& settings) {
    PanelActions actions;
    const float line = ImGui::GetTextLineHeight();
    ImGui::SetNextWindowPos(ImVec2(line * 0.6f, line * 0.6f), ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowBgAlpha(0.85f);
    if (ImGui::Begin("ewa", nullptr, ImGuiWindowFlags_AlwaysAutoResize)) {
        // A window that was tiny for a moment has pushed the panel outside.
        const ImVec2 at = ImGui::GetWindowPos();
        if (at.x < 0 || at.y < 0) ImGui::SetWindowPos(ImVec2(std::max(at.x, 0.0f), std::max(at.y, 0.0f)));
        actions.right = ImGui::GetWindowPos().x + ImGui::GetWindowSize().x;
        show_facts(facts);
        ImGui::Separator();
        ImGui::PushItemWidth(line * 10);
        edit_look(facts, settings.look);
        choose_up(facts, actions);
        ImGui::Checkbox("turntable", &settings.turntable);
        if (facts.run && ImGui::CollapsingHeader("Training", ImGuiTreeNodeFlags_DefaultOpen))
            actions.command = draw_training(*facts.run);
        if (facts.dataset && ImGui::CollapsingHeader("Cameras", ImGuiTreeNodeFlags_DefaultOpen))
            edit_cameras(facts, settings, actions);
        if (facts.views && ImGui::CollapsingHeader("Views and film")) edit_views(facts, settings, actions);
        show_details(facts);
        ImGui::PopItemWidth();
        actions.screenshot = ImGui::Button("Screenshot");
        ImGui::SameLine();
        actions.exr = ImGui::Button("EXR");
        ImGui::SameLine();
        actions.reset = ImGui::Button("Reset view");
        if (!facts.note.empty()) {
            ImGui::PushTextWrapPos(line * 18);
            ImGui::TextUnformatted(facts.note.c_str());
            ImGui::PopTextWrapPos();
        }
        ImGui::TextDisabled("F1: keys   F2: hide this panel");
    }
    ImGui::End();
    return actions;
}

void draw_help(bool& open) {
    static const std::array<std::array<const char*, 2>, 25> rows{
        {{"left drag", "orbit the scene"},
         {"Ctrl + left drag", "look around"},
         {"right or middle drag", "move sideways"},
         {"wheel", "move closer or farther"},
         {"double click", "look at this point and orbit it"},
         {"W S  A D  Q E", "fly: forward, back; left, right; down, up"},
         {"Shift", "fly four times as fast"},
         {"T", "turntable"},
         {"U", "change the up axis"},
         {"R", "reset the view"},
         {"", ""},
         {"1 2 3 4 5", "colour, depth, opacity, splats per pixel, ellipsoids"},
         {"- +", "make splats smaller, larger"},
         {"C", "show cameras; a click goes to one"},
         {"left right", "go to the previous, next camera"},
         {"G", "go to the nearest camera"},
         {"V", "compare with the image: beside, wipe, difference"},
         {"", ""},
         {"Ctrl + 1 to 9", "save this view under a number"},
         {"Shift + 1 to 9", "go to the saved view"},
         {"F12", "screenshot (PNG); with Shift: EXR"},
         {"F1", "show or hide these keys"},
         {"F2", "show or hide the panel"},
         {"Ctrl + Q", "quit"},
         {"drop a file", "open it: splats, dataset, or folder of a run"}}};
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos(ImVec2(size.x / 2, size.y / 2), ImGuiCond_Appearing, ImVec2(0.5f, 0.5f));
    if (ImGui::Begin("Keys", &open, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse) &&
        ImGui::BeginTable("keys", 2, ImGuiTableFlags_SizingFixedFit)) {
        for (const auto& row : rows)
            for (const char* text : row) {
                ImGui::TableNextColumn();
                ImGui::TextUnformatted(text);
            }
        ImGui::EndTable();
    }
    ImGui::End();
}

}  // namespace ewa::viewer
