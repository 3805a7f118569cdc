// SPDX-License-Identifier: Apache-2.0
#include "viewer/overlay.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "scene/camera.h"

namespace ewa::viewer {
namespace {

struct Axis {
    const char* name;
    glm::dvec3 axis;
};
const std::array kAxes{Axis{"-y", {0, -1, 0}}, Axis{"+y", {0, 1, 0}}, Axis{"+z", {0, 0, 1}},
                       Axis{"-z", {0, 0, -1}}, Axis{"+x", {1, 0, 0}}, Axis{"-x", {-1, 0, 0}}};

void show_facts(const PanelFacts& facts) {
    ImGui::TextUnformatted(facts.scene.title.c_str());
    if (!facts.picture) {
        ImGui::Text("%zu splats", facts.scene.gaussians->size());
        return;
    }
    const RenderedFrame& shown = *facts.picture;
    ImGui::Text("%zu splats, %u visible", facts.scene.gaussians->size(), shown.splats_drawn);
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
    if (facts.scene.sh_degree > 0) {
        look.sh_degree = std::min(look.sh_degree, facts.scene.sh_degree);
        ImGui::SliderInt("SH degree", &look.sh_degree, 0, facts.scene.sh_degree, "%d",
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
    const int last = int(facts.scene.dataset->frames.size()) - 1;
    int frame = facts.at_camera.value_or(0);
    if (ImGui::SliderInt("camera", &frame, 0, last, facts.at_camera ? "%d" : "-",
                         ImGuiSliderFlags_AlwaysClamp))
        actions.frame = frame;
    if (facts.at_camera)
        ImGui::TextDisabled("%s", facts.scene.dataset->frames[size_t(*facts.at_camera)].name.c_str());
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

constexpr size_t kMostPoints = 400;  // of a plotted curve

/// At most kMostPoints values: means over groups of neighbours.
std::vector<float> curve(const std::vector<float>& values) {
    if (values.size() <= kMostPoints) return values;
    std::vector<float> means(kMostPoints);
    for (size_t i = 0; i < kMostPoints; ++i) {
        const size_t from = i * values.size() / kMostPoints, to = (i + 1) * values.size() / kMostPoints;
        means[i] = std::accumulate(values.begin() + std::ptrdiff_t(from), values.begin() + std::ptrdiff_t(to),
                                   0.0f) /
                   float(to - from);
    }
    return means;
}

void plot(const char* name, const std::vector<float>& values, const char* format) {
    if (values.size() < 2) return;
    const std::vector<float> points = curve(values);
    const auto [least, most] = std::minmax_element(points.begin(), points.end());
    const float margin = std::max(1e-6f, 0.05f * (*most - *least));
    const float line = ImGui::GetTextLineHeight();
    ImGui::TextUnformatted(name);
    ImGui::SameLine();
    ImGui::Text(format, double(values.back()));
    ImGui::PushID(name);
    ImGui::PlotLines("", points.data(), int(points.size()), 0, nullptr, *least - margin, *most + margin,
                     ImVec2(line * 17, line * 4));
    ImGui::PopID();
}

/// Returns what the user asked for: pause, resume or save.
std::optional<std::string> draw_training(const live::Update& run) {
    const live::Status& status = run.status;
    const bool done = status.state == live::State::done, paused = status.state == live::State::paused;
    std::optional<std::string> command;
    if (status.step == 0 && run.problem.empty()) {
        ImGui::TextUnformatted("waiting for the first step ...");
        return command;
    }
    ImGui::Text("%s: step %d of %d, %.0f s",
                paused ? "paused"
                : done ? "done"
                       : "training",
                status.step, status.steps, status.seconds);
    if (status.steps > 0)
        ImGui::ProgressBar(float(status.step) / float(status.steps),
                           ImVec2(ImGui::GetTextLineHeight() * 17, 0));
    if (run.splats_step >= 0 && !done) ImGui::Text("splats of step %d", run.splats_step);
    std::vector<float> loss, psnr;
    for (const report::MetricsLine& line : status.metrics) {
        if (std::isfinite(line.loss)) loss.push_back(float(line.loss));
        if (line.test_psnr && std::isfinite(*line.test_psnr)) psnr.push_back(float(*line.test_psnr));
    }
    plot("loss", loss, "%.4f");
    plot("held-out PSNR", psnr, "%.2f dB");
    if (psnr.size() == 1) ImGui::Text("held-out PSNR %.2f dB", double(psnr.front()));
    if (!done && run.connected && status.commands) {
        if (ImGui::Button(paused ? "Resume" : "Pause")) command = paused ? "resume" : "pause";
        ImGui::SameLine();
        if (ImGui::Button("Save now")) command = "save";
    } else if (!done) {
        ImGui::TextDisabled(run.connected ? "watching; --token lets you pause and save"
                                          : "watching the files of the run");
    }
    if (!run.problem.empty()) ImGui::TextWrapped("%s", run.problem.c_str());
    return command;
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
    if (ImGui::CollapsingHeader("Skipped work")) {
        for (const PlanLine& line : facts.scene.plan) {
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
        if (facts.scene.dataset && ImGui::CollapsingHeader("Cameras", ImGuiTreeNodeFlags_DefaultOpen))
            edit_cameras(facts, settings, actions);
        if (ImGui::CollapsingHeader("Views and film")) edit_views(facts, settings, actions);
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
