// SPDX-License-Identifier: Apache-2.0
// The panel over the picture, and the list of keys. Draws with Dear ImGui; changes only what it is given.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "io/datasets/view_list.h"
#include "live/watcher.h"
#include "viewer/photo_comparison.h"
#include "viewer/render_thread.h"

namespace ewa::viewer {

/// What the panel shows.
struct PanelFacts {
    std::string title, device;
    size_t splats = 0;
    int scene_sh_degree = 0;           // highest that changes the picture
    const Dataset* dataset = nullptr;  // null: no cameras
    const FinishedPicture* picture = nullptr;
    const std::vector<PlanLine>* plan = nullptr;  // what is left out
    const std::vector<io::NamedView>* views = nullptr;
    const live::Update* run = nullptr;     // null: nothing is being trained
    bool drawing = false;                  // a better picture is on its way
    std::string note;                      // of the last screenshot, or what failed
    std::string photo_failure;             // why the photograph cannot be had
    std::optional<double> psnr;            // of this view, as shown
    double pictures_a_second = 0;          // while the camera moves; else 0
    std::optional<double> first_picture;   // seconds after the start
    int film_frame = -1, film_frames = 0;  // where one is being written
    glm::dvec3 up{0};
    std::optional<int> stands_at;  // the camera that is looked through
};

/// What it changes.
struct PanelSettings {
    Look look;
    Comparison comparison = Comparison::none;
    float wipe = 0.5f;  // share of the photograph's width that it has
    float gain = 4;     // of the difference
    bool cameras = false, turntable = false;
    float film_seconds = 2;  // from view to view
};

/// What the user did in it.
struct PanelActions {
    bool screenshot = false, exr = false, reset = false, save_view = false, film = false, stop_film = false,
         write_views = false;
    std::optional<int> frame;
    std::optional<size_t> view, forget;
    std::optional<glm::dvec3> up;
    std::optional<std::string> command;  // for the trainer
    float right = 0;                     // of what the panel covers, in ImGui's coordinates
};

PanelActions draw_panel(const PanelFacts& facts, PanelSettings& settings);
void draw_help(bool& open);

/// The up axis that comes after this one; the first of the six where it is none of them.
glm::dvec3 next_up(const glm::dvec3& up);

}  // namespace ewa::viewer
