// SPDX-License-Identifier: Apache-2.0
#include "viewer/panel.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

namespace ewa::viewer {
namespace {

struct Axis {
    const char* name;
    glm::dvec3 axis;
};
constexpr int kNoteLines = 3;

const std::array kAxes{Axis{"-y", {0, -1, 0}}, Axis{"+y", {0, 1, 0}}, Axis{"+z", {0, 0, 1}},
                       Axis{"-z", {0, 0, -1}}, Axis{"+x", {1, 0, 0}}, Axis{"-x", {-1, 0, 0}}};

/// The height of a row with a slider, where there is none.
void empty_row() {
    ImGui::Dummy(ImVec2(1, ImGui::GetFrameHeight()));
}

/// Text in a row of the height of a slider.
void text_row(const char* format, double a, double b = 0) {
    ImGui::AlignTextToFramePadding();
    ImGui::Text(format, a, b);
}

void show_facts(const PanelFacts& facts) {
    ImGui::TextUnformatted(facts.scene.title.empty() ? "no file" : facts.scene.title.c_str());
    const char* what = facts.scene.points ? "points" : "splats";
    if (!facts.picture) {
        ImGui::Text("%zu %s", facts.scene.gaussians->size(), what);
        ImGui::TextUnformatted("");
        return;
    }
    const RenderedFrame& shown = *facts.picture;
    if (shown.skipped_nonfinite > 0)
        ImGui::Text("%zu %s, %u not finite", facts.scene.gaussians->size(), what, shown.skipped_nonfinite);
    else
        ImGui::Text("%zu %s, %u visible", facts.scene.gaussians->size(), what, shown.splats_drawn);
    ImGui::Text("%d x %d px in %.1f ms%s", shown.picture.width, shown.picture.height, shown.milliseconds,
                facts.drawing ? "  ..." : "");
}

/// What the colours of the mode mean, or the background behind them.
void edit_background(const PanelFacts& facts, Look& look) {
    const bool shown = facts.picture && facts.picture->request.look.mode == look.mode;
    if ((look.mode == Mode::color || look.mode == Mode::ellipsoids) && look.sky)
        ImGui::TextUnformatted("background: the run's sky");
    else if (look.mode == Mode::color || look.mode == Mode::ellipsoids)
        ImGui::ColorEdit3("background", look.background.data(), ImGuiColorEditFlags_NoInputs);
    else if ((look.mode == Mode::depth || look.mode == Mode::median_depth) && shown)
        text_row("dark %.4g to white %.4g", double(facts.picture->picture.dark),
                 double(facts.picture->picture.white));
    else if (look.mode == Mode::count && shown)
        text_row("red, yellow, white: up to %.0f", double(facts.picture->picture.white));
    else
        empty_row();
}

void edit_look(const PanelFacts& facts, Look& look) {
    int mode = int(look.mode);
    if (ImGui::Combo("mode", &mode,
                     "colour\0depth\0opacity\0splats per pixel\0ellipsoids\0median depth\0normals\0"))
        look.mode = Mode(mode);
    edit_background(facts, look);
    ImGui::SliderFloat("splat scale", &look.splat_scale, 0.05f, 2.0f, "%.2f", ImGuiSliderFlags_AlwaysClamp);
    look.sh_degree = std::min(look.sh_degree, facts.scene.sh_degree);
    ImGui::BeginDisabled(facts.scene.sh_degree == 0);
    ImGui::SliderInt("SH degree", &look.sh_degree, 0, std::max(1, facts.scene.sh_degree), "%d",
                     ImGuiSliderFlags_AlwaysClamp);
    ImGui::EndDisabled();
    constexpr int kPoints = 3;
    int kernel = look.points ? kPoints : int(look.kernel);
    if (ImGui::Combo("kernel", &kernel, "peak (3DGS)\0antialias\0density (EWA)\0points (spheres)\0")) {
        look.points = kernel == kPoints;
        if (!look.points) look.kernel = Footprint(kernel);
    }
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

std::string comparison_text(const PanelFacts& facts, const PanelSettings& settings) {
    if (settings.comparison == Comparison::none) return "";
    if (!facts.image_failure.empty()) return facts.image_failure;
    if (!facts.at_camera) return "G: go to the nearest camera";
    if (!facts.psnr || std::isnan(*facts.psnr)) return "";
    const Camera& camera = facts.scene.dataset->frames[size_t(*facts.at_camera)].camera;
    std::array<char, 96> text{};
    std::snprintf(text.data(), text.size(), "PSNR of this view %.2f dB\nat the image's %d x %d px",
                  *facts.psnr, camera.width, camera.height);
    return text.data();
}

void edit_cameras(const PanelFacts& facts, PanelSettings& settings, PanelActions& actions) {
    const int last = int(facts.scene.dataset->frames.size()) - 1;
    int frame = facts.at_camera.value_or(0);
    if (ImGui::SliderInt("camera", &frame, 0, last, facts.at_camera ? "%d" : "-",
                         ImGuiSliderFlags_AlwaysClamp))
        actions.frame = frame;
    ImGui::TextDisabled("%s", facts.at_camera
                                  ? facts.scene.dataset->frames[size_t(*facts.at_camera)].name.c_str()
                                  : "between the cameras");
    ImGui::Checkbox("show cameras", &settings.cameras);
    int comparison = int(settings.comparison);
    if (ImGui::Combo("compare", &comparison, "none\0beside\0wipe\0difference\0"))
        settings.comparison = Comparison(comparison);
    if (settings.comparison == Comparison::wipe)
        ImGui::SliderFloat("wipe", &settings.wipe, 0, 1, "%.2f", ImGuiSliderFlags_AlwaysClamp);
    else if (settings.comparison == Comparison::difference)
        ImGui::SliderFloat("gain", &settings.gain, 1, 16, "%.0f", ImGuiSliderFlags_AlwaysClamp);
    else
        empty_row();
    draw_text_box("comparison", comparison_text(facts, settings), 2);
}

void edit_views(const PanelFacts& facts, PanelSettings& settings, PanelActions& actions) {
    if (ImGui::Button("Save this view")) actions.save_view = true;
    for (size_t i = 0; i < facts.views.size(); ++i) {
        ImGui::PushID(int(i));
        if (ImGui::Button(facts.views[i].name.c_str())) actions.view = i;
        ImGui::SameLine();
        if (ImGui::SmallButton("x")) actions.forget = i;
        ImGui::PopID();
    }
    if (facts.views.empty()) return;
    if (ImGui::Button("Write to a file")) actions.write_views = true;
    if (facts.views.size() < 2) return;
    ImGui::SliderFloat("s per view", &settings.film_seconds, 0.2f, 10, "%.1f", ImGuiSliderFlags_AlwaysClamp);
    if (facts.film) {
        ImGui::ProgressBar(*facts.film);
        actions.stop_film = ImGui::Button("Stop film");
    } else {
        actions.film = ImGui::Button("Write film");
    }
}

void cells(const char* name, const char* format, double value) {
    ImGui::TableNextColumn();
    ImGui::TextUnformatted(name);
    ImGui::TableNextColumn();
    ImGui::Text(format, value);
}

void show_times(const PanelFacts& facts) {
    if (!ImGui::BeginTable("times", 2, ImGuiTableFlags_SizingStretchProp)) return;
    for (const PassTime& time : facts.picture->pass_times)
        if (time.milliseconds >= 0.005) cells(time.pass.c_str(), "%.2f ms", time.milliseconds);
    cells("request to frame", "%.2f ms", facts.picture->milliseconds);
    if (const double rate = facts.times.rate(); rate > 0) cells("moving, per second", "%.1f", rate);
    if (const auto first = facts.times.first_frame()) cells("first frame", "%.0f ms", 1000 * *first);
    ImGui::EndTable();
}

void show_details(const PanelFacts& facts) {
    if (ImGui::CollapsingHeader("Time") && facts.picture) show_times(facts);
    if (ImGui::CollapsingHeader("Skipped work")) {
        ImGui::PushTextWrapPos(0);
        for (const PlanLine& line : facts.scene.plan) {
            ImGui::TextUnformatted(line.what.c_str());
            if (line.bytes_saved > 0)
                ImGui::TextDisabled("    saves %.1f MiB", double(line.bytes_saved) / (1 << 20));
        }
        ImGui::PopTextWrapPos();
    }
    if (ImGui::CollapsingHeader("Memory and device") && facts.picture) {
        ImGui::Text("%.1f MiB on the device", double(facts.picture->device_bytes) / (1 << 20));
        ImGui::TextWrapped("%s", facts.device.c_str());
    }
}

void choose_text(PanelSettings& settings) {
    constexpr std::array kSizes{0.75f, 1.0f, 1.25f, 1.5f, 2.0f};
    const auto name = [](float size) { return std::to_string(int(100 * size + 0.5f)) + " %"; };
    if (!ImGui::BeginCombo("text size", name(settings.text_scale).c_str())) return;
    for (const float size : kSizes)
        if (ImGui::Selectable(name(size).c_str(), size == settings.text_scale)) settings.text_scale = size;
    ImGui::EndCombo();
}

void draw_rows(const PanelFacts& facts, PanelSettings& settings, PanelActions& actions) {
    show_facts(facts);
    ImGui::Separator();
    ImGui::PushItemWidth(ImGui::GetTextLineHeight() * 9.5f);
    edit_look(facts, settings.look);
    choose_up(facts, actions);
    ImGui::Checkbox("turntable", &settings.turntable);
    ImGui::SameLine();
    ImGui::Checkbox("parallel rays", &settings.parallel);
    const bool trainable = facts.scene.dataset && !facts.scene.path.empty() && facts.scene.points;
    if ((facts.run || trainable) && ImGui::CollapsingHeader("Training", ImGuiTreeNodeFlags_DefaultOpen))
        draw_training(facts, settings, actions);
    if (facts.scene.dataset && ImGui::CollapsingHeader("Cameras", ImGuiTreeNodeFlags_DefaultOpen))
        edit_cameras(facts, settings, actions);
    if (ImGui::CollapsingHeader("Views and film")) edit_views(facts, settings, actions);
    ImGui::Checkbox("measure: click two points", &settings.measure);
    show_details(facts);
    if (ImGui::CollapsingHeader("Window")) choose_text(settings);
    ImGui::PopItemWidth();
}

/// A button of the footer. Returns whether it is clicked.
bool button(const char* name, const char* explanation) {
    const bool clicked = ImGui::Button(name);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", explanation);
    return clicked;
}

void draw_footer(const PanelFacts& facts, PanelActions& actions) {
    actions.whole_scene = button("Whole scene", "F: from the front");
    ImGui::SameLine();
    actions.reset = button("First view", "R");
    ImGui::SameLine();
    actions.screenshot = button("PNG", "F12: writes a screenshot");
    ImGui::SameLine();
    actions.exr = button("EXR", "Shift + F12: writes the render in floating point");
    ImGui::TextDisabled("F1: keys   F2: hide this");
    ImGui::SameLine();
    if (ImGui::SmallButton("Open")) ImGui::OpenPopup("open");
    if (ImGui::BeginPopup("open")) {
        if (ImGui::MenuItem("A file", "Ctrl+O")) actions.open = Wanted::file;
        if (ImGui::MenuItem("A folder", "Ctrl+Shift+O")) actions.open = Wanted::folder;
        ImGui::EndPopup();
    }
    draw_text_box("note", facts.note, kNoteLines);
}

/// The height of draw_footer().
float footer_height() {
    return ImGui::GetFrameHeightWithSpacing() +
           float(kNoteLines + 1) * ImGui::GetTextLineHeightWithSpacing() +
           3 * ImGui::GetStyle().ItemSpacing.y;
}

}  // namespace

glm::dvec3 next_up(const glm::dvec3& up) {
    for (size_t i = 0; i < kAxes.size(); ++i)
        if (kAxes[i].axis == up) return kAxes[(i + 1) % kAxes.size()].axis;
    return kAxes[0].axis;
}

PanelActions draw_panel(const PanelFacts& facts, PanelSettings& settings) {
    PanelActions actions;
    const float height = ImGui::GetIO().DisplaySize.y;
    ImGui::SetNextWindowPos(ImVec2(0, 0));
    ImGui::SetNextWindowSize(ImVec2(facts.width, height));
    ImGui::SetNextWindowBgAlpha(facts.over_picture ? 0.85f : 1.0f);
    constexpr auto kFlags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                            ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus;
    if (ImGui::Begin("panel", nullptr, kFlags)) {
        // In a low window the footer scrolls with the rows.
        const float footer = footer_height();
        const bool low = height < 2 * footer;
        ImGui::BeginChild("rows", ImVec2(0, low ? 0 : -footer));
        draw_rows(facts, settings, actions);
        if (low) draw_footer(facts, actions);
        ImGui::EndChild();
        if (!low) {
            ImGui::Separator();
            draw_footer(facts, actions);
        }
    }
    ImGui::End();
    return actions;
}

}  // namespace ewa::viewer
