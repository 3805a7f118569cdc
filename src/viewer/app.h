// SPDX-License-Identifier: Apache-2.0
// The viewer: from input to requests, from finished pictures to the window.
#pragma once
#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include "viewer/gui.h"
#include "viewer/pace.h"
#include "viewer/panel.h"
#include "viewer/view_camera.h"

namespace ewa::viewer {

struct Opened {
    std::filesystem::path file;
    Gaussians gaussians;
    std::optional<Dataset> dataset;
    int frame = 0;                                 // of the dataset
    std::optional<Size> size;                      // of the window
    std::optional<std::filesystem::path> picture;  // write it and be done
    std::shared_ptr<gpu::Device> device;
};

class App {
  public:
    /// Opens the window. Throws RunError.
    explicit App(const Opened& opened);

    /// Until the window is closed, or the one picture is written. Throws RunError, InputError.
    void run();

  private:
    using Clock = std::chrono::steady_clock;

    void handle_key(int key);
    void handle_mouse();
    void fly(double seconds);
    bool flying() const;
    void ask();
    void take_news();
    bool settled() const;  // what is shown is the full picture of what is wanted
    void draw();
    void panel();
    void save(const Image& image);
    double patience() const;

    const Opened& opened_;
    WindowSystem system_;
    Window window_;
    PresentDevice present_device_;
    Presenter presenter_;
    Gui gui_;
    ViewCamera view_;
    Look look_;
    int scene_sh_degree_ = 0;
    int frame_ = 0;
    Pace pace_;
    std::shared_ptr<const FinishedPicture> shown_;
    PictureRequest asked_;
    Clock::time_point changed_;  // when what is wanted last changed
    Clock::time_point last_frame_;
    bool show_panel_ = true, show_help_ = false;
    bool capture_ = false;  // write the picture as soon as it is the full one
    int redraws_ = 0;       // frames still to draw: ImGui answers input over a few
    std::string note_;
    bool done_ = false;
    RenderThread thread_;  // last: it is gone before what it wakes
};

}  // namespace ewa::viewer
