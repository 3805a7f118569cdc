// SPDX-License-Identifier: Apache-2.0
// The camera of the window, the keys that move it, and saved views.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "io/datasets/view_list.h"
#include "viewer/view_camera.h"
#include "viewer/view_state.h"

namespace ewa::viewer {

inline constexpr float kStillPixels = 4;  // a shorter drag is a click

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

class Navigation {
  public:
    explicit Navigation(ViewState& state);

    /// Forgets the places in the scene before. frame: of the dataset, whose camera the view is at.
    void enter_scene(std::optional<int> frame);
    /// The first splats tell what to look at, unless the user has moved the camera.
    void take_splats();

    void handle_key(const KeyPress& press);
    void obey(const PanelActions& actions);
    void drag(double right, double down, Size place);
    /// Turns the turntable, and flies where the held keys say.
    void move(double seconds);
    bool flying() const;

    void go_to_camera(int frame);
    void go_to_nearest_camera();
    void leave_camera() { at_camera.reset(); }
    /// The frame of `at_camera`, if that is set.
    const Frame& frame() const { return state_.scene.dataset->frames[size_t(*at_camera)]; }

    void start_film();
    /// Asks for the next frame once the last one is written.
    void continue_film(Renders& renders);

    ViewCamera view;
    std::optional<int> at_camera;       // the frame of the dataset whose camera the view is at
    std::optional<int> pointed_camera;  // the frame whose camera is under the pointer
    double camera_size = 1;             // of a drawn camera, world units
    bool framed = false;                // the first view was chosen when there were splats
    std::vector<io::NamedView> views;   // saved under a number, which is the name
    std::optional<Film> film;

  private:
    void handle_number(size_t number, const KeyPress& press);
    void stand(const Viewpoint& place);
    void step_camera(int step);
    void reset();
    void show_whole_scene();
    std::vector<io::NamedView>::iterator find(size_t number);
    void go_to(const io::NamedView& saved);
    void save_view(size_t number);
    void write_views();

    ViewState& state_;
    std::optional<int> start_frame_;  // the frame that reset() returns to
};

}  // namespace ewa::viewer
