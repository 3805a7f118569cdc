// SPDX-License-Identifier: Apache-2.0
// The state that the parts of the window share: the window itself, the open scene, the settings, and the options of
// the command line.
#pragma once
#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ewa/capture.h"
#include "io/datasets/view_list.h"
#include "viewer/kept_settings.h"
#include "viewer/message.h"
#include "viewer/opening.h"
#include "viewer/renders.h"
#include "viewer/training.h"
#include "viewer/view_camera.h"
#include "viewer/window.h"

namespace ewa::viewer {

/// A training on photos, which starts once they have cameras.
struct LaterTraining {
    std::vector<std::string> options;  // of ewa train, with the photos
    std::filesystem::path folder;      // of the run
    CaptureOptions capture;
};

/// The tabs of the panel.
enum class PanelTab { view, edit };

/// What the panel and keys change.
struct PanelSettings : KeptSettings {
    Look look;
    Comparison comparison = Comparison::none;
    float wipe = 0.5f;  // share of the width that shows the image
    bool cameras = false, turntable = false;
    bool parallel = false;  // orthographic projection
    bool measure = false;   // clicks choose points, whose distance is shown
    PanelTab tab = PanelTab::view;
    /// Steps of a training that the window starts: those of a row of train::kQualities, or another number.
    int train_steps = 0;
};

/// The options of the command line.
struct Startup {
    OpenedScene scene;
    std::optional<int> frame;       // of the dataset
    std::optional<Size> size;       // of the window, px
    std::filesystem::path picture;  // write this screenshot, then exit; empty: none
    std::filesystem::path
        film;  // write a film through `views` into this folder, without a window; empty: none
    std::vector<io::NamedView> views;
    std::optional<size_t> budget;  // most splats to draw while the view changes
    PanelSettings settings;
    OpenDevice open_device;
    struct {
        std::string name;
        std::string selector;  // of the command line
    } device;
    std::optional<live::WhatToWatch> watch;  // a training run
    TrainProcess* trainer = nullptr;         // the viewer's own; outlives the window
    std::optional<LaterTraining> later;      // if the scene is photos
    bool verbose = false;                    // print times on standard error
    SessionTimes times;
};

/// The image size of the dataset's camera that the window starts from. Without a camera, the usual size.
Size camera_size_or_usual(const Startup& startup);
/// The first view: of the dataset's camera `frame`, or of the whole scene for an image of this size.
Viewpoint start_view(const OpenedScene& scene, std::optional<int> frame, Size size);
std::string window_title(const OpenedScene& scene);
/// The first of <stem>-1<extension>, <stem>-2<extension>, ... that does not exist.
std::filesystem::path free_name(const std::string& stem, const std::string& extension);

/// The state of the window's main loop: the frames that it has still to draw, and whether it ends.
struct Loop {
    static constexpr int kRedraws = 3;  // frames that ImGui needs to answer input
    std::chrono::steady_clock::time_point last_frame = std::chrono::steady_clock::now();
    int redraws = kRedraws;  // frames that are still to draw
    bool capture = false;    // write a screenshot as soon as the full frame is shown
    bool done = false;
    int devices_lost = 0;
    SessionTimes times;
};

struct ViewState {
    /// Opens the window. Throws RunError.
    explicit ViewState(const Startup& startup);
    ViewState(const ViewState&) = delete;
    ViewState& operator=(const ViewState&) = delete;

    bool scripted() const { return !startup.picture.empty(); }
    void redraw(int frames = 1) { loop.redraws = std::max(loop.redraws, frames); }
    void say(const std::string& note, bool until_edit = false);  // as Message::say
    double text_height() const;                                  // px of the framebuffer
    int panel_width() const;  // px of the framebuffer, also while it is hidden
    bool panel_fits() const;  // the window has room for the panel beside the picture
    bool empty() const { return scene.title.empty() && !scene.dataset && scene.gaussians->size() == 0; }
    bool panel_shown() const { return !scripted() && !empty() && (panel_fits() ? panel_beside : panel_over); }
    bool& panel_wanted() { return panel_fits() ? panel_beside : panel_over; }
    /// The place of the panel: beside the picture and the bars, or over the picture.
    Rectangle panel_area() const;
    /// Whether the bars of the editor frame the picture: not in a small window.
    bool bars_shown() const;
    /// The part of the window beside the panel, with the bars.
    Rectangle frame_area() const;
    /// The part of the window that the panel and the bars leave to the pictures.
    Rectangle picture_area() const;

    const Startup& startup;
    std::unique_ptr<TrainProcess> trainer;  // started by the window, which is closed before it ends
    WindowSystem system;
    Window window;
    std::atomic<bool> woken = false;  // by wake(), so the next frame shows news
    std::function<void()> wake = [this] {
        woken = true;
        system.wake();
    };  // any thread may call it, while the state lives
    OpenedScene scene;
    PanelSettings settings;
    std::string device_name;
    std::optional<bool> on_cpu;  // whether the device is one; empty: it is not open
    Message message;
    Loop loop;
    bool panel_beside = true;  // in a window with room for the panel
    bool panel_over = false;   // in a narrow window, where the panel lies over the picture
    bool help = false;
};

}  // namespace ewa::viewer
