// SPDX-License-Identifier: Apache-2.0
// The panel at the left of the window. The functions change only their arguments.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "io/datasets/view_list.h"
#include "live/watcher.h"
#include "viewer/comparison.h"
#include "viewer/file_dialog.h"
#include "viewer/opening.h"
#include "viewer/renders.h"

namespace ewa::viewer {

/// What the panel shows.
struct PanelFacts {
    const OpenedScene& scene;
    size_t splats;  // or points, after edits
    const std::string& device;
    std::optional<bool> on_cpu;    // whether the device is a CPU; empty: not known
    const RenderedFrame* picture;  // null: none yet
    const std::vector<io::NamedView>& views;
    const live::Update* run;           // null: no training run
    std::filesystem::path run_folder;  // of that run; may be empty
    bool drawing;                      // the frame is not final: a better one is being rendered
    std::string note;                  // the last message, after the picture no longer shows it
    std::string image_failure;         // why the camera's image cannot be shown
    std::optional<double> psnr;        // of this view against the image
    const SessionTimes& times;
    glm::dvec3 up;
    std::optional<int> at_camera;  // the camera that the view is at
    Rectangle place;               // of the panel, px of the framebuffer
    bool over_picture;             // the panel lies over the picture, which shines through
};

/// The tabs of the panel.
enum class PanelTab { view, edit };

/// What the panel changes.
struct PanelSettings {
    Look look;
    Comparison comparison = Comparison::none;
    float wipe = 0.5f;  // share of the width that shows the image
    float gain = 4;     // factor of the difference image
    bool cameras = false, turntable = false;
    bool parallel = false;   // orthographic projection
    bool measure = false;    // clicks choose points, whose distance is shown
    float film_seconds = 2;  // from one key of a film to the next
    float text_scale = 1;    // times the size that the monitor asks for
    bool light = false;      // the light theme
    PanelTab tab = PanelTab::view;
    /// Steps of a training that the window starts: those of a row of train::kQualities, or another number.
    int train_steps = 0;
};

/// What the user asked for in the panel.
struct PanelActions {
    bool screenshot = false, exr = false, reset = false, whole_scene = false, save_view = false, film = false,
         write_views = false, train = false;
    std::optional<int> frame;
    std::optional<size_t> view, forget;
    std::optional<glm::dvec3> up;
    std::optional<std::string> command;  // for the training run: pause, resume or save
    std::optional<Wanted> open;          // by the file dialog
};

/// edit_rows: draws the tab "Edit"; empty: there are no tabs.
PanelActions draw_panel(const PanelFacts& facts, PanelSettings& settings,
                        const std::function<void()>& edit_rows = {});

/// The section of a training run, or of a dataset that one can be started on. Part of draw_panel().
void draw_training(const PanelFacts& facts, PanelSettings& settings, PanelActions& actions);

/// Draws a label. The next item gets the rest of the line.
void label_field(const char* label);
/// Draws the heading of a section that folds. open: whether it is open at first. open_now: opens it. Returns whether it is open.
bool draw_section(const char* name, bool open, bool open_now = false);
/// The number of lines of text that wraps at the border of the window; not more than `most`.
int text_lines(const std::string& text, int most);
/// Draws text that wraps, in a box of `least` to `most` lines. It scrolls if it has more.
void draw_text_box(const char* name, const std::string& text, int least, int most);

/// The next of the six axes; the first one if `up` is not an axis.
glm::dvec3 next_up(const glm::dvec3& up);

}  // namespace ewa::viewer
