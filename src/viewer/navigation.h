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

    /// Two neighbouring views are kRate * seconds frames apart. The first and the last view are frames of the film.
    Film(const std::vector<io::NamedView>& views, const std::filesystem::path& folder, Size size,
         double seconds);
    bool finished() const { return next >= frames; }
    Camera camera() const;
    std::filesystem::path file() const;
};

class Navigation {
  public:
    explicit Navigation(ViewState& state);

    /// Shows the scene in state_, and forgets views of the previous scene. frame: the dataset's frame whose camera is the view.
    void enter_scene(std::optional<int> frame);
    /// Chooses the first view once the scene has splats, unless the user has already moved the camera.
    void take_splats();

    void handle_key(const KeyPress& press);
    void obey(const PanelActions& actions);
    void drag(double right, double down, Size place);
    /// Moves the camera by the motion of so many seconds: around the turntable, and in the directions of the held keys.
    void move(double seconds);
    bool flying() const;

    void go_to_camera(int frame);
    void go_to_nearest_camera();
    void leave_camera() { at_camera.reset(); }
    /// The frame of `at_camera`, if that is set.
    const Frame& frame() const { return state_.scene.dataset->frames[size_t(*at_camera)]; }

    void start_film();
    /// Requests the render of the film's next frame once the previous frame is written.
    void continue_film(Renders& renders);

    ViewCamera view;
    std::optional<int> at_camera;       // the frame of the dataset whose camera the view is at
    std::optional<int> pointed_camera;  // the frame whose camera is under the pointer
    double camera_size = 1;             // size of a drawn camera's frustum, world units
    bool framed = false;                // the first view was chosen from splats, not before any were there
    std::vector<io::NamedView> views;   // saved views; the name of each is the number of its key
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
