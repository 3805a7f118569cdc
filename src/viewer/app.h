// SPDX-License-Identifier: Apache-2.0
// The viewer's window thread: turns input into requests, and finished frames into what the window shows.
#pragma once
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
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
#include "viewer/overlay.h"
#include "viewer/panel.h"
#include "viewer/renders.h"
#include "viewer/screen.h"
#include "viewer/training.h"
#include "viewer/view_camera.h"
#include "viewer/view_quality.h"

namespace ewa::viewer {

/// A film that is being written: frames along the path through saved views, one file each.
struct Film {
    static constexpr int kRate = 30;  // frames per second

    std::filesystem::path folder;
    std::vector<Camera> keys;  // at least one
    Size size;                 // of every frame, also if the window changes
    int frames = 0, next = 0;
    uint64_t waits_for = 0;  // serial of the frame that is being written; 0: none

    /// The keys are kRate * seconds frames apart; the first and last key are frames.
    Film(const std::vector<io::NamedView>& views, const std::filesystem::path& folder, Size size,
         double seconds);
    bool finished() const { return next >= frames; }
    Camera camera() const;
    std::filesystem::path file() const;
};

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
    void redraw(int frames = 1) { redraws_ = std::max(redraws_, frames); }
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
    void leave_camera() { at_camera_.reset(); }
    void reset_view();
    void show_whole_scene();
    void change_comparison();
    std::vector<io::NamedView>::iterator find_view(size_t number);
    void save_view(size_t number);
    void go_to_view(const io::NamedView& view);
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
    bool panel_shown() const { return !scripted() && (panel_fits() ? show_panel_ : show_over_panel_); }
    Rectangle picture_area() const;
    Comparison comparison() const { return at_camera_ ? settings_.comparison : Comparison::none; }
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
    double camera_size_ = 1;          // of a drawn camera, world units
    std::optional<int> start_frame_;  // the frame that "reset" returns to
    bool framed_ = false;             // the first view was chosen when there were splats
    ViewCamera view_;
    std::optional<int> at_camera_;  // the frame of the dataset whose camera the view is at
    PanelSettings settings_;
    std::vector<io::NamedView> views_;  // saved under a number, which is the name
    std::optional<Film> film_;
    SessionTimes times_;
    std::string device_name_;
    Message message_;

    std::shared_ptr<const ByteImage> on_screen_;  // the presenter's picture: a render or a difference
    bool difference_on_screen_ = false;
    std::optional<double> shown_psnr_;  // in the panel, dB
    Clock::time_point last_frame_;
    bool show_panel_ = true;        // in a window with room for it
    bool show_over_panel_ = false;  // in a narrow window, where it lies over the picture
    bool show_help_ = false, dragging_wipe_ = false;
    bool capture_ = false;               // write a screenshot as soon as the full frame is shown
    std::optional<int> pointed_camera_;  // the frame whose camera is under the pointer
    static constexpr int kRedraws = 3;   // frames that ImGui needs to answer input
    int redraws_ = kRedraws;             // frames that are still to draw
    int devices_lost_ = 0;
    double shown_text_ = 0;     // text_height() of the screen
    bool live_failed_ = false;  // a training that cannot be reached was reported
    bool done_ = false;
    std::string search_failure_;  // why photos have no cameras; one line
    std::future<OpenedScene> opening_;
    std::future<std::string> saving_;  // a screenshot; the message about it

    // Their threads call wake() of the window system. Declared last, so that they end before it does.
    CameraSearch search_;
    FileDialog dialog_;
    ImageComparison comparison_;
    ViewQuality quality_;
    Renders renders_;
    LiveRun live_;
};

/// The first of <stem>-1<extension>, <stem>-2<extension>, ... that does not exist.
std::filesystem::path free_name(const std::string& stem, const std::string& extension);

}  // namespace ewa::viewer
