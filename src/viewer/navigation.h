// SPDX-License-Identifier: Apache-2.0
// The camera of the window, the keys that move it, and saved views.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "io/datasets/view_list.h"
#include "viewer/view_camera.h"
#include "viewer/view_state.h"

namespace ewa::viewer {

inline constexpr float kStillPixels = 4;  // a shorter drag is a click

/// An axis that can point up.
struct Axis {
    const char* name;
    glm::dvec3 axis;
};
inline const std::array kAxes{Axis{"-y", {0, -1, 0}}, Axis{"+y", {0, 1, 0}}, Axis{"+z", {0, 0, 1}},
                              Axis{"-z", {0, 0, -1}}, Axis{"+x", {1, 0, 0}}, Axis{"-x", {-1, 0, 0}}};
/// The next of the six axes; the first one if `up` is not an axis.
glm::dvec3 next_up(const glm::dvec3& up);

class Navigation {
  public:
    explicit Navigation(ViewState& state);

    /// Shows the scene in state_, and forgets views of the previous scene. frame: the dataset's frame whose camera is the view.
    void enter_scene(std::optional<int> frame);
    /// Chooses the first view once the scene has splats, unless the user has already moved the camera.
    void take_splats();

    void handle_key(const KeyPress& press);
    void drag(double right, double down, Size place);
    /// Moves the camera by the motion of so many seconds: around the turntable, and in the directions of the held keys.
    void move(double seconds);
    bool flying() const;

    /// Returns to the first view.
    void reset();
    void show_whole_scene();
    void go_to_camera(int frame);
    void go_to_nearest_camera();
    void leave_camera() { at_camera.reset(); }
    /// The frame of `at_camera`, if that is set.
    const Frame& frame() const { return state_.scene.dataset->frames[size_t(*at_camera)]; }

    /// Moves the camera, and stops the turntable.
    void stand(const Viewpoint& place);
    /// Shows a saved view.
    void go_to(const io::NamedView& saved);
    /// The present view, without a name.
    io::NamedView here() const;
    /// Saves the present view under the first free number. time: of a key of a film, or empty.
    void add_view(std::optional<double> time);
    /// Writes the saved views into a file with a free name, with their times if any of them has one.
    void write_views();

    ViewCamera view;
    std::optional<int> at_camera;       // the frame of the dataset whose camera the view is at
    std::optional<int> pointed_camera;  // the frame whose camera is under the pointer
    double camera_size = 1;             // size of a drawn camera's frustum, world units
    bool framed = false;                // the first view was chosen from splats, not before any were there
    std::vector<io::NamedView> views;   // saved views; the name of each is the number of its key

  private:
    void handle_number(size_t number, const KeyPress& press);
    void step_camera(int step);
    std::vector<io::NamedView>::iterator find(size_t number);
    void save_view(size_t number);

    ViewState& state_;
    std::optional<int> start_frame_;  // the frame that reset() returns to
};

}  // namespace ewa::viewer
