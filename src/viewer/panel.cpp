// SPDX-License-Identifier: Apache-2.0
#include "viewer/panel.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <cstdio>
#include <string>

#include "core/text.h"
#include "viewer/editor/texts.h"
#include "viewer/editor/theme.h"
#include "viewer/overlay.h"
#include "viewer/panel_rows.h"

namespace ewa::viewer {
namespace {

constexpr int kNoteLines = 3;

/// What is open, in two lines.
void show_title(const WindowParts& parts) {
    const OpenedScene& scene = parts.state.scene;
    ImGui::TextUnformatted(scene.title.c_str());
    const char* what = scene.points ? "point" : "splat";
    const EditSnapshot& edited = parts.editor.snapshot();
    const bool edits = parts.editor.scenes() > 0 && edited.splats;
    std::string text = core::grouped(edits ? edited.left : scene.gaussians->size(), what);
    if (const RenderedFrame* picture = parts.picture(); picture && picture->skipped_nonfinite > 0)
        text += ", " + core::grouped(picture->skipped_nonfinite) + " not finite";
    ImGui::TextDisabled("%s", text.c_str());
}

/// What the colours of the mode mean, or the background behind them.
void edit_background(const RenderedFrame* picture, Look& look) {
    const bool shown = picture && picture->request.look.mode == look.mode;
    const bool color = look.mode == Mode::color || look.mode == Mode::ellipsoids;
    const bool depth = look.mode == Mode::depth || look.mode == Mode::median_depth;
    if (!color && !depth && look.mode != Mode::count) return;
    label_field(color ? "Background" : "Scale");
    if (color && look.sky)
        ImGui::TextUnformatted("the run's sky");
    else if (color)
        ImGui::ColorEdit3("##background", look.background.data(), ImGuiColorEditFlags_NoInputs);
    else if (!shown)
        ImGui::TextUnformatted("...");  // it is being rendered
    else if (depth)
        ImGui::Text("%.4g to %.4g", double(picture->picture.dark), double(picture->picture.white));
    else
        ImGui::Text("red to white: %.0f", double(picture->picture.white));
}

void edit_look(const WindowParts& parts) {
    PanelSettings& settings = parts.state.settings;
    Look& look = settings.look;
    int mode = int(look.mode);
    label_field("Show");
    if (ImGui::Combo("##mode", &mode, texts::kModes)) look.mode = Mode(mode);
    edit_background(parts.picture(), look);
    label_field("Splat size");
    ImGui::SliderFloat("##splat scale", &look.splat_scale, 0.05f, 2.0f, "%.2f", ImGuiSliderFlags_AlwaysClamp);
    ImGui::Checkbox("Turntable", &settings.turntable);
    ImGui::SameLine();
    ImGui::Checkbox("Parallel rays", &settings.parallel);
    ImGui::Checkbox("Measure: click two points", &settings.measure);
}

/// What the rendering of splats depends on.
void edit_rendering(const OpenedScene& scene, Look& look) {
    look.sh_degree = std::min(look.sh_degree, scene.sh_degree);
    if (scene.sh_degree > 0) {
        label_field("SH degree");
        ImGui::SliderInt("##SH degree", &look.sh_degree, 0, scene.sh_degree, "%d",
                         ImGuiSliderFlags_AlwaysClamp);
    }
    constexpr int kPoints = 3;
    int kernel = look.points ? kPoints : int(look.kernel);
    label_field("Kernel");
    if (ImGui::Combo("##kernel", &kernel, texts::kKernels)) {
        look.points = kernel == kPoints;
        if (!look.points) look.kernel = Footprint(kernel);
    }
}

void choose_up(ViewCamera& view) {
    const char* present = "from cameras";
    for (const Axis& choice : kAxes)
        if (choice.axis == view.up()) present = choice.name;
    label_field("Up");
    if (!ImGui::BeginCombo("##up", present)) return;
    for (const Axis& choice : kAxes)
        if (ImGui::Selectable(choice.name, choice.name == present)) view.set_up(choice.axis);
    ImGui::EndCombo();
}

std::string comparison_text(const WindowParts& parts) {
    if (std::string failure = parts.shown.image_failure(); !failure.empty()) return failure;
    if (!parts.navigation.at_camera) return "G: go to the nearest camera";
    const std::optional<double> psnr = parts.shown.psnr();
    if (!psnr || std::isnan(*psnr)) return "";
    const Camera& camera = parts.navigation.frame().camera;
    std::array<char, 96> text{};
    std::snprintf(text.data(), text.size(), "PSNR of this view %.2f dB\nat the image's %d x %d px", *psnr,
                  camera.width, camera.height);
    return text.data();
}

void edit_cameras(const WindowParts& parts) {
    PanelSettings& settings = parts.state.settings;
    Navigation& navigation = parts.navigation;
    const int last = int(parts.state.scene.dataset->frames.size()) - 1;
    int frame = navigation.at_camera.value_or(0);
    label_field("Camera");
    if (ImGui::SliderInt("##camera", &frame, 0, last, navigation.at_camera ? "%d" : "-",
                         ImGuiSliderFlags_AlwaysClamp))
        navigation.go_to_camera(frame);
    ImGui::TextDisabled("%s", navigation.at_camera ? navigation.frame().name.c_str() : "between the cameras");
    ImGui::Checkbox("Show cameras", &settings.cameras);
    int comparison = int(settings.comparison);
    label_field("Compare");
    if (ImGui::Combo("##compare", &comparison, texts::kComparisons))
        settings.comparison = Comparison(comparison);
    if (settings.comparison == Comparison::none) return;
    if (settings.comparison == Comparison::wipe) {
        label_field("Wipe");
        ImGui::SliderFloat("##wipe", &settings.wipe, 0, 1, "%.2f", ImGuiSliderFlags_AlwaysClamp);
    } else if (settings.comparison == Comparison::difference) {
        label_field("Gain");
        ImGui::SliderFloat("##gain", &settings.gain, 1, 16, "%.0f", ImGuiSliderFlags_AlwaysClamp);
    }
    // The rows below do not move while the slider goes from camera to camera.
    draw_text_box("comparison", comparison_text(parts), 2, 2);
}

void edit_views(const WindowParts& parts) {
    Navigation& navigation = parts.navigation;
    std::vector<io::NamedView>& views = navigation.views;
    if (ImGui::Button("Save this view")) navigation.add_view({});
    std::optional<size_t> forgotten;
    for (size_t i = 0; i < views.size(); ++i) {
        ImGui::PushID(int(i));
        if (ImGui::Button(views[i].name.c_str())) navigation.go_to(views[i]);
        ImGui::SameLine();
        if (ImGui::SmallButton("x")) forgotten = i;
        ImGui::PopID();
    }
    if (forgotten) views.erase(views.begin() + std::ptrdiff_t(*forgotten));
    if (views.empty()) return;
    if (ImGui::Button("Write to a file")) navigation.write_views();
    ImGui::SameLine();
    if (ImGui::Button("Film")) parts.film.shown = !parts.film.shown;
}

void cells(const char* name, const char* format, double value) {
    ImGui::TableNextColumn();
    ImGui::TextUnformatted(name);
    ImGui::TableNextColumn();
    ImGui::Text(format, value);
}

void show_times(const RenderedFrame& picture, const SessionTimes& times) {
    if (!ImGui::BeginTable("times", 2, ImGuiTableFlags_SizingStretchProp)) return;
    for (const PassTime& time : picture.pass_times)
        if (time.milliseconds >= 0.005) cells(time.pass.c_str(), "%.2f ms", time.milliseconds);
    cells("request to frame", "%.2f ms", picture.milliseconds);
    if (const double rate = times.rate(); rate > 0) cells("moving, per second", "%.1f", rate);
    if (const auto first = times.first_frame()) cells("first frame", "%.0f ms", 1000 * *first);
    ImGui::EndTable();
}

void show_details(const WindowParts& parts) {
    const OpenedScene& scene = parts.state.scene;
    const RenderedFrame* picture = parts.picture();
    if (picture) {
        ImGui::TextDisabled("%s visible",
                            core::grouped(picture->splats_drawn, scene.points ? "point" : "splat").c_str());
        ImGui::TextDisabled("%d x %d px in %.1f ms%s", picture->picture.width, picture->picture.height,
                            picture->milliseconds, parts.shown.renders.settled() ? "" : "  ...");
    }
    edit_rendering(scene, parts.state.settings.look);
    choose_up(parts.navigation.view);
    if (draw_section("Time", false) && picture) show_times(*picture, parts.state.loop.times);
    if (draw_section("Skipped work", false)) {
        ImGui::PushTextWrapPos(0);
        for (const PlanLine& line : scene.plan) {
            ImGui::TextUnformatted(line.what.c_str());
            if (line.bytes_saved > 0)
                ImGui::TextDisabled("    saves %.1f MiB", double(line.bytes_saved) / (1 << 20));
        }
        ImGui::PopTextWrapPos();
    }
    if (draw_section("Memory and device", false) && picture) {
        ImGui::Text("%.1f MiB on the device", double(picture->device_bytes) / (1 << 20));
        ImGui::TextWrapped("%s", parts.state.device_name.c_str());
    }
}

void choose_window(PanelSettings& settings) {
    constexpr std::array kSizes{0.75f, 1.0f, 1.25f, 1.5f, 2.0f};
    const auto name = [](float size) { return std::to_string(int(100 * size + 0.5f)) + " %"; };
    label_field("Text size");
    if (ImGui::BeginCombo("##text size", name(settings.text_scale).c_str())) {
        for (const float size : kSizes)
            if (ImGui::Selectable(name(size).c_str(), size == settings.text_scale))
                settings.text_scale = size;
        ImGui::EndCombo();
    }
    int theme = settings.light ? 1 : 0;
    label_field("Theme");
    if (ImGui::Combo("##theme", &theme, texts::kThemes)) settings.light = theme == 1;
}

void draw_rows(const WindowParts& parts) {
    const OpenedScene& scene = parts.state.scene;
    show_title(parts);
    ImGui::PushItemWidth(ImGui::GetTextLineHeight() * 9.5f);
    if (draw_section(texts::kLook, true)) edit_look(parts);
    const bool trainable = scene.dataset && !scene.path.empty() && scene.points;
    if ((parts.session.live_run.update() || trainable) && draw_section(texts::kTraining, true))
        draw_training(parts);
    if (scene.dataset && draw_section(texts::kCameras, true)) edit_cameras(parts);
    if (draw_section(texts::kSavedViews, false)) edit_views(parts);
    if (draw_section(texts::kDetails, false)) show_details(parts);
    if (draw_section(texts::kWindow, false)) choose_window(parts.state.settings);
    ImGui::PopItemWidth();
}

/// The tabs at the upper border. The accent marks the one that is shown.
void draw_tabs(PanelTab& shown) {
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const float width = ImGui::GetContentRegionAvail().x / 2, height = 1.25f * ImGui::GetFrameHeight();
    for (const PanelTab tab : {PanelTab::view, PanelTab::edit}) {
        const char* name = tab == PanelTab::view ? texts::kTabView : texts::kTabEdit;
        if (tab == PanelTab::edit) ImGui::SameLine(0, 0);
        if (ImGui::InvisibleButton(name, ImVec2(width, height))) shown = tab;
        const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
        const bool bright = tab == shown || ImGui::IsItemHovered();
        const ImVec2 size = ImGui::CalcTextSize(name);
        list.AddText({(low.x + high.x - size.x) / 2, (low.y + high.y - size.y) / 2},
                     ImGui::GetColorU32(bright ? ImGuiCol_Text : ImGuiCol_TextDisabled), name);
        const float line = (tab == shown ? 0.12f : 0.06f) * ImGui::GetTextLineHeight();
        list.AddRectFilled({low.x, high.y - line}, high,
                           tab == shown ? accent() : ImGui::GetColorU32(ImGuiCol_Separator));
    }
}

/// One of two buttons of the footer that share a line. Returns whether it is clicked.
bool footer_button(const char* name, const char* explanation) {
    const float gap = ImGui::GetStyle().ItemSpacing.x;
    const float width = (ImGui::GetWindowWidth() - 2 * ImGui::GetStyle().WindowPadding.x - gap) / 2;
    const bool clicked = ImGui::Button(name, ImVec2(width, 0));
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", explanation);
    return clicked;
}

void draw_footer(const WindowParts& parts, const std::string& note) {
    draw_text_box("note", note, 0, kNoteLines);
    if (footer_button("Whole scene", "From the front (F, if nothing is selected)"))
        parts.navigation.show_whole_scene();
    ImGui::SameLine();
    if (footer_button("First view", "As at the start (R in the tab View)")) parts.navigation.reset();
    if (footer_button("Open", "A file or a folder")) ImGui::OpenPopup("open");
    ImGui::SameLine();
    if (footer_button("Save picture", "F12: a PNG. Shift + F12: an EXR")) ImGui::OpenPopup("picture");
    if (ImGui::BeginPopup("open")) {
        if (ImGui::MenuItem("A file", "Ctrl+O")) parts.session.dialog.ask(Wanted::file);
        if (ImGui::MenuItem("A folder", "Ctrl+Shift+O")) parts.session.dialog.ask(Wanted::folder);
        ImGui::EndPopup();
    }
    if (ImGui::BeginPopup("picture")) {
        if (ImGui::MenuItem("What you see (PNG)", "F12")) parts.state.loop.capture = true;
        if (ImGui::MenuItem("The render in floating point (EXR)", "Shift+F12")) parts.shown.write_exr();
        ImGui::EndPopup();
    }
}

/// The height of draw_footer() and of the separator above it.
float footer_height(const std::string& note) {
    const float gap = ImGui::GetStyle().ItemSpacing.y;
    const int lines = text_lines(note, kNoteLines);
    return 2 * ImGui::GetFrameHeightWithSpacing() + gap +
           (lines > 0 ? float(lines) * ImGui::GetTextLineHeight() + gap : 0);
}

/// Keeps which sections of a tab are open, and how far it is scrolled. Another theme or text size begins with a new ImGui.
void keep_rows(PanelTab tab) {
    static std::array<ImGuiStorage, 2> sections;
    static std::array<float, 2> scrolled{};  // in heights of the text
    ImGui::SetStateStorage(&sections[size_t(tab)]);
    const float line = ImGui::GetTextLineHeight();
    if (ImGui::IsWindowAppearing())
        ImGui::SetScrollY(scrolled[size_t(tab)] * line);
    else
        scrolled[size_t(tab)] = ImGui::GetScrollY() / line;
}

}  // namespace

void draw_panel(const WindowParts& parts) {
    ViewState& state = parts.state;
    const Rectangle place = state.panel_area();
    // The last message, after the picture no longer shows it.
    const std::string note = state.message.noting(Message::Clock::now()) ? "" : state.message.note;
    const ImVec2 size = gui_point(place.width, place.height);
    const float height = size.y;
    ImGui::SetNextWindowPos(gui_point(place.x, place.y));
    ImGui::SetNextWindowSize(size);
    ImGui::SetNextWindowBgAlpha(state.panel_fits() ? 1.0f : 0.93f);
    constexpr auto kFlags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                            ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus |
                            ImGuiWindowFlags_NoFocusOnAppearing;
    ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 0);
    const bool open = ImGui::Begin("panel", nullptr, kFlags);
    ImGui::PopStyleVar(2);
    if (open) {
        const bool tabs = parts.editor.scenes() > 0;
        if (tabs) draw_tabs(state.settings.tab);
        const bool editing = tabs && state.settings.tab == PanelTab::edit;
        // In a low window the footer scrolls with the rows.
        const float footer = footer_height(note);
        const bool low = height < 3 * footer;
        ImGui::BeginChild(editing ? "edits" : "rows", ImVec2(0, low ? 0 : -footer));
        keep_rows(editing ? PanelTab::edit : PanelTab::view);
        if (editing)
            parts.edits.draw(parts.editor, state);
        else
            draw_rows(parts);
        if (low) draw_footer(parts, note);
        ImGui::EndChild();
        if (!low) {
            ImGui::Separator();
            draw_footer(parts, note);
        }
    }
    ImGui::End();
}

}  // namespace ewa::viewer
