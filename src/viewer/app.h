// SPDX-License-Identifier: Apache-2.0
// The viewer's window thread: turns input into requests, and finished frames into what the window shows.
#pragma once
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/datasets/view_list.h"
#include "viewer/camera_search.h"
#include "viewer/file_dialog.h"
#include "viewer/kept_settings.h"
#include "viewer/message.h"
#include "viewer/navigation.h"
#include "viewer/overlay.h"
#include "viewer/panel.h"
#include "viewer/renders.h"
#include "viewer/screen.h"
#include "viewer/training.h"
#include "viewer/view_camera.h"
#include "viewer/view_quality.h"

namespace ewa::viewer {

/// A training on photos, which starts once they have cameras.
struct LaterTraining {
    std::vector<std::string> options;  // of ewa train, with the photos
    std::filesystem::path folder;      // of the run
    CaptureOptions capture;
};

/// What the command line asks for.
struct Startup {
    OpenedScene scene;
    std::optional<int> frame;                      // of the dataset
    std::optional<Size> size;                      // of the window, px
    std::optional<Size> last_size;                 // of the last session's window, as KeptSettings::window
    std::optional<std::filesystem::path> picture;  // write this screenshot, then exit
    std::optional<std::filesystem::path> film;     // write a film through `views` into this folder, then exit
    std::vector<io::NamedView> views;
    PanelSettings settings;
    OpenDevice open_device;
    std::string device_name;
    std::string device;                      // the selector of the command line
    std::optional<live::WhatToWatch> watch;  // a training run
    TrainProcess* trainer = nullptr;         // the viewer's own; outlives the App
    std::optional<LaterTraining> later;      // if the scene is photos
    bool verbose = false;                    // print times on standard error
    SessionTimes times;
};

/// The size of the dataset's camera that the window starts from, or the usual one.
Size camera_size_or_usual(const Startup& startup);
/// The first view: of the dataset's camera `frame`, or of the whole scene for an image of this size.
Viewpoint start_view(const OpenedScene& scene, std::optional<int> frame, Size size);

std::string window_title(const OpenedScene& scene);

/// What the loop of the window has still to do.
struct Loop {
    static constexpr int kRedraws = 3;  // frames that ImGui needs to answer input
    std::chrono::steady_clock::time_point last_frame = std::chrono::steady_clock::now();
    int redraws = kRedraws;  // frames that are still to draw
    bool capture = false;    // write a screenshot as soon as the full frame is shown
    bool done = false;
    int devices_lost = 0;
    SessionTimes times;
};

/// What lies beside or over the picture.
struct Panels {
    bool beside = true;  // in a window with room for the panel
    bool over = false;   // in a narrow window, where the panel lies over the picture
    bool help = false, dragging_wipe = false;
};

/// The picture on the screen, and how it compares with the image of its camera.
struct Shown {
    explicit Shown(const std::function<void()>& wake) : comparison(wake), quality(wake) {}

    std::shared_ptr<const ByteImage> picture;  // the presenter's: a render or a difference
    bool difference = false;
    std::optional<double> psnr;  // in the panel, dB
    double text_height = 0;      // of the screen
    ImageComparison comparison;
    ViewQuality quality;
};

/// What is on its way into the window, and out of it.
struct Session {
    explicit Session(const std::function<void()>& wake) : search(wake), dialog(wake), live(wake) {}

    template <class Result>
    static bool finished(const std::future<Result>& future) {
        return future.valid() && future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    }

    bool live_failed = false;    // a training that cannot be reached was reported
    std::string search_failure;  // why photos have no cameras; one line
    std::future<OpenedScene> opening;
    std::future<std::string> saving;  // a screenshot; the message about it
    CameraSearch search;
    FileDialog dialog;
    LiveRun live;
};

class App {
  public:
    /// Opens the window. Throws RunError.
    explicit App(const Startup& startup);

    /// Runs until the window is closed or the requested files are written. Throws RunError, InputError.
    void run();
    /// What the next session should start with.
    KeptSettings kept() const;

  private:
    using Clock = std::chrono::steady_clock;

    // app_open.cpp: scenes that are opened, and training runs.
    void adopt(OpenedScene scene, std::optional<int> frame);
    void show_opened(OpenedScene scene);
    void open(const std::vector<std::filesystem::path>& paths, const OpenedScene& shown);
    void take_opened();
    void take_chosen();
    void find_cameras(const std::filesystem::path& photos);
    void take_found();
    void take_live();
    void train();
    void start_training(const std::vector<std::string>& options, const std::filesystem::path& folder);
    bool training();  // one that the window has started
    void watch(const live::WhatToWatch& what, TrainProcess* trainer);
    bool empty() const;  // nothing is open, nor on its way
    std::optional<Headline> headline() const;
    std::string banner() const;

    // app.cpp: the loop, and what the threads report.
    void take_renders();
    void take_comparison();
    std::optional<Camera> requested_camera() const;
    bool scripted() const { return startup_.picture || startup_.film; }
    double patience() const;
    void redraw(int frames = 1) { loop_.redraws = std::max(loop_.redraws, frames); }
    void say(const std::string& note);

    // app_input.cpp: keys, the mouse, the dataset's cameras, saved views, and the film.
    void handle_key(const KeyPress& press);
    void handle_number(int number, const KeyPress& press);
    void handle_mouse();
    void handle_drag(double right, double down);
    void move_by_itself(double seconds);
    bool flying() const;
    void go_to_camera(int frame);
    void go_to_nearest_camera();
    void step_camera(int step);
    void show_whole_scene();
    void change_comparison();
    void save_view(size_t number);
    void go_to_number(size_t number);
    void write_views();
    void start_film();
    void continue_film();

    // app_draw.cpp: one frame of the window.
    void draw();
    bool present(ImDrawData* drawn, Image* capture);
    void panel();
    void obey(const PanelActions& actions);
    void draw_overlays();
    void load_image();
    void choose_picture();
    void measure_view();
    void change_text();
    double text_height() const;  // px of the framebuffer
    int panel_width() const;     // px of the framebuffer, also while it is hidden
    bool panel_fits() const;     // beside the picture
    bool panel_shown() const { return !scripted() && (panel_fits() ? panels_.beside : panels_.over); }
    Rectangle picture_area() const;
    Comparison comparison() const { return navigation_.at_camera ? settings_.comparison : Comparison::none; }
    bool comparing() const;  // the image of the camera is shown or compared
    std::optional<ComparisonRequest> comparison_wanted() const;
    Arrangement arrangement() const;
    void save(Image&& image);
    void save_exr();

    const Startup& startup_;
    std::unique_ptr<TrainProcess> trainer_;  // started by the window, which is closed before it ends
    WindowSystem system_;
    Window window_;
    std::unique_ptr<Screen> screen_;
    OpenedScene scene_;
    PanelSettings settings_;
    std::string device_name_;
    Message message_;
    Loop loop_;
    Panels panels_;
    Navigation navigation_;

    // Their threads call wake() of the window system. Declared last, so that they end before it does.
    Shown shown_;
    Renders renders_;
    Session session_;
};

/// The first of <stem>-1<extension>, <stem>-2<extension>, ... that does not exist.
std::filesystem::path free_name(const std::string& stem, const std::string& extension);

}  // namespace ewa::viewer
