// SPDX-License-Identifier: Apache-2.0
#include "viewer/navigation.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <string>

#include "ewa/error.h"
#include "viewer/editor/film.h"

namespace ewa::viewer {
namespace {

constexpr double kRadiansPerPixel = 0.005;
constexpr double kFlySpeed = 0.8;        // distances to the pivot per second
constexpr double kTurntableSpeed = 0.4;  // radians per second

}  // namespace

Navigation::Navigation(ViewState& state)
    : view(start_view(state.startup.scene, state.startup.frame, state.startup.size.value_or(kUsualSize))),
      views(state.startup.views),
      state_(state) {}

void Navigation::enter_scene(std::optional<int> frame) {
    const OpenedScene& scene = state_.scene;
    framed = scene.gaussians->size() > 0;
    leave_camera();
    start_frame_.reset();
    if (!scene.dataset) return;
    camera_size = viewer::camera_size(*scene.dataset, view.radius());
    start_frame_ = at_camera = frame.value_or(0);
}

void Navigation::take_splats() {
    if (!framed && (!state_.scene.dataset || at_camera == start_frame_))
        view.restart(start_view(state_.scene, start_frame_, state_.picture_area().size()));
    framed = true;
}

void Navigation::handle_number(size_t number, const KeyPress& press) {
    if (press.control) return save_view(number);
    if (press.shift) {
        if (const auto saved = find(number); saved != views.end()) return go_to(*saved);
        const std::string name = std::to_string(number);
        state_.say("there is no view " + name + "; Ctrl + " + name + " saves one");
    } else if (number <= size_t(kModes)) {
        state_.settings.look.mode = Mode(number - 1);
    }
}

void Navigation::handle_key(const KeyPress& press) {
    const int key = press.key;
    if (key >= GLFW_KEY_1 && key <= GLFW_KEY_9) return handle_number(size_t(key - GLFW_KEY_1 + 1), press);
    bool& turntable = state_.settings.turntable;
    if (key == GLFW_KEY_R) turntable = false;
    if (key == GLFW_KEY_R) reset();
    if (key == GLFW_KEY_F) show_whole_scene();
    if (key == GLFW_KEY_T) turntable = !turntable;
    if (key == GLFW_KEY_P) state_.settings.parallel = !state_.settings.parallel;
    if (key == GLFW_KEY_U) view.set_up(next_up(view.up()));
    if (key == GLFW_KEY_G) go_to_nearest_camera();
    if (key == GLFW_KEY_LEFT) step_camera(-1);
    if (key == GLFW_KEY_RIGHT) step_camera(1);
}

void Navigation::drag(double right, double down, Size place) {
    const ImGuiIO& io = ImGui::GetIO();
    const bool left_button = ImGui::IsMouseDown(ImGuiMouseButton_Left);
    if (left_button && io.KeyCtrl) {
        view.look(right * kRadiansPerPixel, down * kRadiansPerPixel);
    } else if (left_button) {
        // Ignore the small motion of a click, so that a double click does not move the camera.
        if (!ImGui::IsMouseDragging(ImGuiMouseButton_Left, kStillPixels)) return;
        view.orbit(right * kRadiansPerPixel, down * kRadiansPerPixel);
    } else if (ImGui::IsMouseDown(ImGuiMouseButton_Right) || ImGui::IsMouseDown(ImGuiMouseButton_Middle)) {
        view.pan(right * io.DisplayFramebufferScale.x, down * io.DisplayFramebufferScale.y, place.width,
                 place.height);
    } else {
        return;
    }
    state_.settings.turntable = false;
    leave_camera();
}

bool Navigation::flying() const {
    const auto held = [&](int key) { return state_.window.held(key); };
    if (ImGui::GetIO().WantTextInput || held(GLFW_KEY_LEFT_CONTROL) || held(GLFW_KEY_RIGHT_CONTROL))
        return false;
    const auto keys = {GLFW_KEY_W, GLFW_KEY_A, GLFW_KEY_S, GLFW_KEY_D, GLFW_KEY_Q, GLFW_KEY_E};
    return std::any_of(keys.begin(), keys.end(), held);
}

void Navigation::move(double seconds) {
    // The screenshot shows the view at the key press, once its full frame is ready.
    if (state_.loop.capture) return;
    if (state_.settings.turntable) {
        view.orbit(kTurntableSpeed * seconds, 0);
        leave_camera();
        state_.redraw();
    }
    if (!flying()) return;
    const auto held = [&](int key) { return state_.window.held(key); };
    const auto either = [&](int minus, int plus) { return double(held(plus)) - double(held(minus)); };
    const bool fast = held(GLFW_KEY_LEFT_SHIFT) || held(GLFW_KEY_RIGHT_SHIFT);
    const glm::dvec3 way(either(GLFW_KEY_A, GLFW_KEY_D), either(GLFW_KEY_E, GLFW_KEY_Q),
                         either(GLFW_KEY_S, GLFW_KEY_W));
    view.fly(way * (seconds * kFlySpeed * (fast ? 4 : 1)));
    leave_camera();
    state_.redraw();
}

void Navigation::stand(const Viewpoint& place) {
    view.stand(place);
    leave_camera();
    state_.settings.turntable = false;
    state_.redraw();
}

void Navigation::go_to_camera(int frame) {
    stand(dataset_view(*state_.scene.gaussians, *state_.scene.dataset, frame));
    at_camera = frame;
}

void Navigation::go_to_nearest_camera() {
    const auto& dataset = state_.scene.dataset;
    if (!dataset) return state_.say("there are no cameras; --cameras DATASET shows a dataset's");
    const Size size = state_.picture_area().size();
    go_to_camera(nearest_frame(*dataset, view.camera(size.width, size.height), view.radius()));
}

void Navigation::step_camera(int step) {
    if (!state_.scene.dataset || !at_camera) return go_to_nearest_camera();
    const int count = int(state_.scene.dataset->frames.size());
    go_to_camera((*at_camera + step + count) % count);
}

void Navigation::reset() {
    view.reset();
    at_camera = start_frame_;
}

void Navigation::show_whole_scene() {
    const Size size = state_.picture_area().size();
    stand(framing_view(*state_.scene.gaussians, state_.scene.dataset.get(), size.width, size.height));
}

std::vector<io::NamedView>::iterator Navigation::find(size_t number) {
    return std::find_if(
        views.begin(), views.end(),
        [name = std::to_string(number)](const io::NamedView& saved) { return saved.name == name; });
}

/// Keeps what is up.
void Navigation::go_to(const io::NamedView& saved) {
    view.stand({saved.camera, saved.pivot, view.up(), view.radius()});
    leave_camera();
}

io::NamedView Navigation::here() const {
    const Size size = state_.picture_area().size();
    return {{}, view.camera(size.width, size.height), view.pivot()};
}

void Navigation::add_view(std::optional<double> time) {
    size_t free = 1;
    while (find(free) != views.end()) ++free;
    save_view(free);
    views.back().time = time;
    if (time) state_.say("Key " + std::to_string(free) + " added");
}

void Navigation::save_view(size_t number) {
    const std::string name = std::to_string(number);
    io::NamedView saved = here();
    saved.name = name;
    if (const auto same = find(number); same != views.end()) {
        saved.time = same->time;
        *same = saved;
    } else {
        views.push_back(saved);
    }
    state_.say("view " + name + " is saved; Shift + " + name + " goes to it");
}

void Navigation::write_views() {
    try {
        const std::filesystem::path file = free_name("ewa-views", ".json");
        if (std::ranges::any_of(views, [](const io::NamedView& saved) { return saved.time.has_value(); }))
            give_times(views, double(state_.settings.film_seconds));
        io::write_views(file, views);
        state_.say("wrote " + std::filesystem::absolute(file).string());
    } catch (const RunError& error) {
        state_.say(error.what());
    }
}

glm::dvec3 next_up(const glm::dvec3& up) {
    for (size_t i = 0; i < kAxes.size(); ++i)
        if (kAxes[i].axis == up) return kAxes[(i + 1) % kAxes.size()].axis;
    return kAxes[0].axis;
}

}  // namespace ewa::viewer
