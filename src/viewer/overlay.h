// SPDX-License-Identifier: Apache-2.0
// What Dear ImGui draws over the image: the panel, the list of keys, cameras, labels, the border of a wipe,
// and notes. The functions change only their arguments.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "io/datasets/view_list.h"
#include "live/watcher.h"
#include "viewer/comparison.h"
#include "viewer/opening.h"

namespace ewa::viewer {

/// What the panel shows.
struct PanelFacts {
    const OpenedScene& scene;
    const std::string& device;
    const RenderedFrame* picture;  // null: none yet
    const std::vector<io::NamedView>& views;
    const live::Update* run;              // null: no training run
    bool drawing;                         // a better frame follows
    const std::string& note;              // the last message
    std::string image_failure;            // why there is no image
    std::optional<double> psnr;           // of this view against the image
    double pictures_a_second;             // of the moving camera; else 0
    std::optional<double> first_picture;  // seconds after the start
    std::optional<float> film;            // share of the film that is written; empty: no film
    glm::dvec3 up;
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
    std::optional<std::string> command;  // for the training run: pause, resume or save
    float right = 0;                     // right border of the panel, in ImGui's coordinates
};

PanelActions draw_panel(const PanelFacts& facts, PanelSettings& settings);
void draw_help(bool& open);

/// The next of the six axes; the first one if `up` is not an axis.
glm::dvec3 next_up(const glm::dvec3& up);

struct CamerasShown {
    const Dataset& dataset;
    const Camera& view;            // of the size of `place`
    Rectangle place;               // of the render in the window, px
    double size = 1;               // of a frustum, world units
    std::optional<int> at_camera;  // this one is not drawn: it would frame the image
};

/// Draws the frustum of each camera. Returns the one under the pointer, which also shows its name.
std::optional<int> draw_cameras(const CamerasShown& cameras);

/// Labels both images. A wipe also has a border, at the share `wipe` of the image's width.
void draw_comparison(Comparison comparison, const Arrangement& arrangement, float wipe);
/// Whether the pointer is at the border of the wipe.
bool over_wipe(const Rectangle& image, float wipe);

/// A message, above the hint.
void draw_note(const std::string& note);
/// The first keys to know, at the lower border. images: there are images to compare with.
void draw_hint(bool images);

}  // namespace ewa::viewer
