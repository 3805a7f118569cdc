// SPDX-License-Identifier: Apache-2.0
// The panel over the image, and the list of keys. Draws with Dear ImGui and changes only its arguments.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "io/datasets/view_list.h"
#include "live/watcher.h"
#include "viewer/comparison.h"
#include "viewer/render_thread.h"

namespace ewa::viewer {

/// What the panel shows.
struct PanelFacts {
    std::string title, device;
    size_t splats = 0;
    int scene_sh_degree = 0;           // highest degree that changes the image
    const Dataset* dataset = nullptr;  // null: there are no cameras
    const RenderedFrame* picture = nullptr;
    const std::vector<PlanLine>* plan = nullptr;  // what rendering skips
    const std::vector<io::NamedView>* views = nullptr;
    const live::Update* run = nullptr;     // null: no training run
    bool drawing = false;                  // a better frame follows
    std::string note;                      // the last message
    std::string image_failure;             // why there is no image
    std::optional<double> psnr;            // of this view against the image
    double pictures_a_second = 0;          // of the moving camera; else 0
    std::optional<double> first_picture;   // seconds after the start
    int film_frame = -1, film_frames = 0;  // of the film that is being written; -1: none
    glm::dvec3 up{0};
    std::optional<int> at_camera;  // the camera that the view is at
};

/// What the panel changes.
struct PanelSettings {
    Look look;
    Comparison comparison = Comparison::none;
    float wipe = 0.5f;  // share of the width that shows the image
    float gain = 4;     // factor of the difference image
    bool cameras = false, turntable = false;
    float film_seconds = 2;  // from one view to the next
};

/// What the user asked for in the panel.
struct PanelActions {
    bool screenshot = false, exr = false, reset = false, save_view = false, film = false, stop_film = false,
         write_views = false;
    std::optional<int> frame;
    std::optional<size_t> view, forget;
    std::optional<glm::dvec3> up;
    std::optional<std::string> command;  // for the training run
    float right = 0;                     // right border of the panel, in ImGui's coordinates
};

PanelActions draw_panel(const PanelFacts& facts, PanelSettings& settings);
void draw_help(bool& open);

/// The next of the six axes; the first one if `up` is not an axis.
glm::dvec3 next_up(const glm::dvec3& up);

}  // namespace ewa::viewer
