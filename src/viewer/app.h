// SPDX-License-Identifier: Apache-2.0
// The viewer: from input to requests, from finished pictures to the window.
#pragma once
#include <chrono>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>

#include "viewer/film.h"
#include "viewer/gui.h"
#include "viewer/latest.h"
#include "viewer/opening.h"
#include "viewer/pace.h"
#include "viewer/panel.h"
#include "viewer/photo.h"
#include "viewer/training.h"
#include "viewer/view_camera.h"

namespace ewa::viewer {

struct Startup {
    Scene scene;
    std::optional<int> frame;                      // of the dataset
    std::optional<Size> size;                      // of the window
    std::optional<std::filesystem::path> picture;  // write it and be done
    std::optional<std::filesystem::path> film;     // write one through the views here and be done
    std::vector<io::NamedView> views;
    PanelSettings settings;
    OpenDevice open_device;
    std::string device_name;
    std::optional<live::WhatToWatch> watch;  // a run
    TrainProcess* trainer = nullptr;         // of this viewer, outlives it
    bool verbose = false;                    // times on standard error
    std::chrono::steady_clock::time_point started = std::chrono::steady_clock::now();
    double read_after = 0, device_after = 0;  // seconds: the scene was read, the device open
};

/// What shows pictures in the window. Made anew where its device is lost.
struct Screen {
    Screen(const WindowSystem& system, Window& window, const std::string& device_name)
        : device(system, window, device_name), presenter(device), gui(window, device, presenter) {}
    PresentDevice device;
    Presenter presenter;
    Gui gui;
};

class App {
  public:
    /// Opens the window. Throws RunError.
    explicit App(const Startup& startup);

    /// Until the window is closed, or the one picture is written. Throws RunError, InputError.
    void run();

  private:
    using Clock = std::chrono::steady_clock;

    // app.cpp: the loop.
    void adopt(Scene scene, std::optional<int> frame);
    void open(const std::filesystem::path& path);
    void take_opened();
    void ask();
    PictureRequest wanted() const;
    void take_news();
    bool settled() const;  // what is shown is the full picture of what is wanted
    bool scripted() const { return startup_.picture || startup_.film; }
    double patience() const;
    void say(const std::string& note);
    void tell_times() const;  // on standard error

    void watch(const live::WhatToWatch& what);
    void take_live();

    // app_input.cpp: keys and the mouse.
    void handle_key(const KeyPress& press);
    void handle_number(int number, const KeyPress& press);
    void handle_mouse();
    void handle_drag(double right, double down);
    void move_by_itself(double seconds);
    bool flying() const;

    // app_cameras.cpp: the dataset's cameras, their photographs, saved views.
    void go_to_camera(int frame);
    void go_to_nearest_camera();
    void step_camera(int step);
    void leave_camera() { stands_at_.reset(); }
    void change_comparison();
    bool comparing() const;
    Arrangement arrangement() const;
    void ask_for_photo();
    std::optional<ComparisonRequest> comparison_wanted() const;
    bool compared() const;  // what comparison_wanted() was is there
    void choose_picture();
    void save_view(size_t number);
    void go_to_view(size_t number);
    void start_film();
    void film();

    // app_draw.cpp: a frame of the window.
    void draw();
    bool present(ImDrawData* drawn, Image* capture);
    void panel();
    void obey(const PanelActions& actions);
    void overlays();
    void save(Image&& image);
    void count_picture();
    void save_exr();

    const Startup& startup_;
    WindowSystem system_;
    Window window_;
    std::unique_ptr<Screen> screen_;
    Scene scene_;
    uint64_t scene_number_ = 0;
    int scene_sh_degree_ = 0;
    std::vector<PlanLine> plan_;
    double camera_size_ = 1;
    ViewCamera view_;
    PanelSettings settings_;
    std::optional<int> start_frame_, stands_at_;  // frames of the dataset
    std::vector<io::NamedView> views_;
    std::optional<Film> film_;
    live::Update run_;
    bool viewed_ = false;  // the view has been chosen for splats that there are
    Pace pace_;
    Fluency fluency_;
    double window_after_ = 0;              // seconds after the start
    std::optional<double> first_picture_;  // the same, that it was shown
    std::string device_name_;

    std::shared_ptr<const FinishedPicture> shown_, counted_;  // the last one; the last that fluency_ knows of
    uint64_t opened_ = 0;                                     // scenes so far
    std::shared_ptr<const Photo> photo_;
    std::optional<PhotoRequest> photo_asked_;
    std::optional<ComparisonRequest> comparison_asked_;
    std::shared_ptr<const Compared> compared_;
    std::shared_ptr<const Picture> on_screen_;  // as the rendering: what the presenter has
    bool difference_on_screen_ = false;
    PictureRequest asked_;
    uint64_t asked_scene_ = 0;
    Clock::time_point changed_;  // when what is wanted last changed
    Clock::time_point last_frame_, hint_until_, note_until_;
    int panel_right_ = 0;  // px of the window that it covers from the left
    bool show_panel_ = true, show_help_ = false, dragging_wipe_ = false;
    bool capture_ = false;  // write the picture as soon as it is the full one
    std::optional<int> pointed_camera_;
    uint64_t points_ = 0, points_asked_ = 0;  // answers to double clicks that were acted on; double clicks
    static constexpr int kRedraws = 3;        // frames over which ImGui answers input
    int redraws_ = 0;                         // that are still to draw
    int devices_lost_ = 0;
    std::string note_;
    bool done_ = false;
    std::future<Scene> opening_;
    std::future<std::string> saving_;  // a screenshot; what there is to say of it
    // Last: they are gone before what they wake.
    Latest<PhotoRequest, Photo> photos_;
    Latest<ComparisonRequest, Compared> comparisons_;
    RenderThread thread_;
    std::unique_ptr<live::Watcher> watcher_;
};

/// The first of <stem>-1<extension>, <stem>-2<extension> … that is not there yet.
std::filesystem::path free_name(const std::string& stem, const std::string& extension);

}  // namespace ewa::viewer
