// SPDX-License-Identifier: Apache-2.0
#include "viewer/panel.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace ewa::viewer {
namespace {

void show_facts(const PanelFacts& facts) {
    ImGui::TextUnformatted(facts.file.c_str());
    ImGui::Text("%zu splats", facts.splats);
    if (!facts.picture) return;
    const FinishedPicture& shown = *facts.picture;
    ImGui::Text("%d x %d px%s", shown.picture.width, shown.picture.height, facts.drawing ? "  ..." : "");
    ImGui::Text("%.1f ms, of it on the device:", shown.milliseconds);
    for (const PassTime& time : shown.pass_times)
        if (time.milliseconds >= 0.005) ImGui::Text("  %-18s %8.2f", time.pass.c_str(), time.milliseconds);
    ImGui::TextDisabled("%s", facts.device.c_str());
    if (shown.skipped_nonfinite > 0)
        ImGui::Text("%u splats are not finite and not drawn", shown.skipped_nonfinite);
}

void edit_look(const PanelFacts& facts, Look& look) {
    int mode = int(look.mode);
    if (ImGui::Combo("mode", &mode, "colour\0depth\0opacity\0")) look.mode = Mode(mode);
    if (look.mode == Mode::depth && facts.picture && facts.picture->request.look.mode == Mode::depth)
        ImGui::Text("white is depth %.4g", double(facts.picture->picture.white_depth));
    if (look.mode == Mode::color) ImGui::ColorEdit3("background", look.background.data());
    if (facts.scene_sh_degree > 0) ImGui::SliderInt("SH degree", &look.sh_degree, 0, facts.scene_sh_degree);
    int kernel = int(look.kernel);
    if (ImGui::Combo("kernel", &kernel, "peak (3DGS)\0antialias\0unit mass (EWA)\0"))
        look.kernel = Kernel(kernel);
}

void choose_up(const PanelFacts& facts, PanelActions& actions) {
    struct Choice {
        const char* name;
        glm::dvec3 axis;
    };
    static const std::array choices{Choice{"-y", {0, -1, 0}}, Choice{"+y", {0, 1, 0}},
                                    Choice{"+z", {0, 0, 1}},  Choice{"-z", {0, 0, -1}},
                                    Choice{"+x", {1, 0, 0}},  Choice{"-x", {-1, 0, 0}}};
    const char* present = "as the cameras";
    for (const Choice& choice : choices)
        if (choice.axis == facts.up) present = choice.name;
    if (!ImGui::BeginCombo("up", present)) return;
    for (const Choice& choice : choices)
        if (ImGui::Selectable(choice.name, choice.name == present)) actions.up = choice.axis;
    ImGui::EndCombo();
}

}  // namespace

PanelActions draw_panel(const PanelFacts& facts, Look& look, int& frame) {
    PanelActions actions;
    const float line = ImGui::GetTextLineHeight();
    ImGui::SetNextWindowPos(ImVec2(line * 0.6f, line * 0.6f), ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowBgAlpha(0.85f);
    if (ImGui::Begin("ewa", nullptr, ImGuiWindowFlags_AlwaysAutoResize)) {
        // A window that was tiny for a moment has pushed the panel out of it.
        const ImVec2 at = ImGui::GetWindowPos();
        if (at.x < 0 || at.y < 0) ImGui::SetWindowPos(ImVec2(std::max(at.x, 0.0f), std::max(at.y, 0.0f)));
        show_facts(facts);
        ImGui::Separator();
        ImGui::PushItemWidth(line * 13);
        edit_look(facts, look);
        choose_up(facts, actions);
        if (facts.dataset && !facts.dataset->frames.empty()) {
            const int last = int(facts.dataset->frames.size()) - 1;
            if (ImGui::SliderInt("camera", &frame, 0, last, "%d", ImGuiSliderFlags_AlwaysClamp))
                actions.frame = frame;
            ImGui::TextDisabled("%s", facts.dataset->frames[size_t(frame)].name.c_str());
        }
        ImGui::PopItemWidth();
        actions.screenshot = ImGui::Button("Screenshot");
        ImGui::SameLine();
        actions.reset = ImGui::Button("Reset view");
        if (!facts.note.empty()) {
            ImGui::PushTextWrapPos(line * 20);
            ImGui::TextUnformatted(facts.note.c_str());
            ImGui::PopTextWrapPos();
        }
        ImGui::TextDisabled("F1: keys");
    }
    ImGui::End();
    return actions;
}

void draw_help(bool& open) {
    static const std::array<std::array<const char*, 2>, 13> rows{{{"left drag", "orbit"},
                                                                  {"Ctrl + left drag", "look around"},
                                                                  {"right or middle drag", "pan"},
                                                                  {"wheel", "closer, farther"},
                                                                  {"W S", "fly forward, back"},
                                                                  {"A D", "fly left, right"},
                                                                  {"Q E", "fly down, up"},
                                                                  {"Shift", "four times as fast"},
                                                                  {"1 2 3", "colour, depth, opacity"},
                                                                  {"R", "back to the start"},
                                                                  {"F1", "these keys"},
                                                                  {"F2", "the panel"},
                                                                  {"F12", "screenshot"}}};
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos(ImVec2(size.x / 2, size.y / 2), ImGuiCond_Appearing, ImVec2(0.5f, 0.5f));
    if (ImGui::Begin("Keys", &open, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse) &&
        ImGui::BeginTable("keys", 2)) {
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
