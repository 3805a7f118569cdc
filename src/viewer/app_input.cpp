// SPDX-License-Identifier: Apache-2.0
// Keys and the mouse, and what they ask for: the dataset's cameras, saved views, and the film through them.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <cstdio>

#include "core/folders.h"
#include "ewa/error.h"
#include "scene/camera.h"
#include "viewer/app.h"

namespace ewa::viewer {
namespace {

constexpr double kRadiansPerPixel = 0.005;
constexpr double kFlySpeed = 0.8;        // distances to the pivot per second
constexpr double kTurntableSpeed = 0.4;  // radians per second
constexpr float kScaleStep = 1.25f, kLeastScale = 0.05f, kMostScale = 2;
constexpr float kStillPixels = 4;  // a shorter drag is a click

}  // namespace

void App::handle_number(int number, const KeyPress& press) {
    if (press.control)
        save_view(size_t(number));
    else if (press.shift)
        go_to_number(size_t(number));
    else if (number <= 5)
        settings_.look.mode = Mode(number - 1);
}

void App::handle_key(const KeyPress& press) {
    const int key = press.key;
    const auto toggle = [](bool& setting) { setting = !setting; };
    // A text field does not use these keys, so they act while one is edited. The other keys belong to the
    // field.
    if (key == GLFW_KEY_Q && press.control) return window_.close();
    if (key == GLFW_KEY_O && press.control) return dialog_.ask(press.shift ? Wanted::folder : Wanted::file);
    if (key == GLFW_KEY_ESCAPE) return search_.cancel();
    switch (key) {
        case GLFW_KEY_F1:
            toggle(show_help_);
            message_.hint_until = {};
            return;
        case GLFW_KEY_F2:
            return toggle(panel_fits() ? show_panel_ : show_over_panel_);
        case GLFW_KEY_F12:
            return press.shift ? save_exr() : void(capture_ = true);
        default:
            break;
    }
    if (ImGui::GetIO().WantTextInput) return;
    if (key >= GLFW_KEY_1 && key <= GLFW_KEY_9) return handle_number(key - GLFW_KEY_1 + 1, press);
    float& scale = settings_.look.splat_scale;
    switch (key) {
        case GLFW_KEY_R:
            reset_view();
            settings_.turntable = false;
            return;
        case GLFW_KEY_F:
            show_whole_scene();
            return;
        case GLFW_KEY_MINUS:
        case GLFW_KEY_KP_SUBTRACT:
            scale = std::max(kLeastScale, scale / kScaleStep);
            return;
        case GLFW_KEY_EQUAL:
        case GLFW_KEY_KP_ADD:
            scale = std::min(kMostScale, scale * kScaleStep);
            return;
        case GLFW_KEY_T:
            return toggle(settings_.turntable);
        case GLFW_KEY_U:
            return view_.set_up(next_up(view_.up()));
        case GLFW_KEY_C:
            return toggle(settings_.cameras);
        case GLFW_KEY_G:
            return go_to_nearest_camera();
        case GLFW_KEY_LEFT:
            return step_camera(-1);
        case GLFW_KEY_RIGHT:
            return step_camera(1);
        case GLFW_KEY_V:
            return change_comparison();
        default:
            return;
    }
}

bool App::flying() const {
    if (ImGui::GetIO().WantTextInput || window_.held(GLFW_KEY_LEFT_CONTROL) ||
        window_.held(GLFW_KEY_RIGHT_CONTROL))
        return false;
    const auto keys = {GLFW_KEY_W, GLFW_KEY_A, GLFW_KEY_S, GLFW_KEY_D, GLFW_KEY_Q, GLFW_KEY_E};
    return std::any_of(keys.begin(), keys.end(), [&](int key) { return window_.held(key); });
}

void App::move_by_itself(double seconds) {
    if (capture_) return;  // the screenshot shows the view at the key press, once its full frame is ready
    if (settings_.turntable) {
        view_.orbit(kTurntableSpeed * seconds, 0);
        leave_camera();
        redraw();
    }
    if (!flying()) return;
    const auto either = [&](int minus, int plus) {
        return double(window_.held(plus)) - double(window_.held(minus));
    };
    const bool fast = window_.held(GLFW_KEY_LEFT_SHIFT) || window_.held(GLFW_KEY_RIGHT_SHIFT);
    const glm::dvec3 way(either(GLFW_KEY_A, GLFW_KEY_D), either(GLFW_KEY_E, GLFW_KEY_Q),
                         either(GLFW_KEY_S, GLFW_KEY_W));
    view_.fly(way * (seconds * kFlySpeed * (fast ? 4 : 1)));
    leave_camera();
    redraw();
}

void App::handle_drag(double right, double down) {
    const ImGuiIO& io = ImGui::GetIO();
    const Rectangle place = arrangement().rendering;
    const bool left_button = ImGui::IsMouseDown(ImGuiMouseButton_Left);
    if (left_button && io.KeyCtrl) {
        view_.look(right * kRadiansPerPixel, down * kRadiansPerPixel);
    } else if (left_button) {
        // Ignore the small motion of a click, so that a double click does not move the camera.
        if (!ImGui::IsMouseDragging(ImGuiMouseButton_Left, kStillPixels)) return;
        view_.orbit(right * kRadiansPerPixel, down * kRadiansPerPixel);
    } else if (ImGui::IsMouseDown(ImGuiMouseButton_Right) || ImGui::IsMouseDown(ImGuiMouseButton_Middle)) {
        view_.pan(right * io.DisplayFramebufferScale.x, down * io.DisplayFramebufferScale.y, place.width,
                  place.height);
    } else {
        return;
    }
    settings_.turntable = false;
    leave_camera();
}

void App::handle_mouse() {
    const ImGuiIO& io = ImGui::GetIO();
    if (io.WantCaptureMouse || scripted()) return;
    const Arrangement places = arrangement();
    const bool wiping = comparing() && settings_.comparison == Comparison::wipe;
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left))
        dragging_wipe_ = wiping && over_wipe(places.image, settings_.wipe);
    if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) dragging_wipe_ = false;
    if (dragging_wipe_ || (wiping && over_wipe(places.image, settings_.wipe)))
        ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
    const double x = io.MousePos.x * double(io.DisplayFramebufferScale.x);
    const double y = io.MousePos.y * double(io.DisplayFramebufferScale.y);
    if (dragging_wipe_) {
        settings_.wipe = float(std::clamp((x - places.image.x) / places.image.width, 0.0, 1.0));
        return;
    }
    if (io.MouseDelta.x != 0 || io.MouseDelta.y != 0) handle_drag(io.MouseDelta.x, io.MouseDelta.y);
    if (io.MouseWheel != 0) {
        view_.zoom(io.MouseWheel);
        leave_camera();
    }
    if (ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) {
        renders_.ask_point(view_.camera(places.rendering.width, places.rendering.height),
                           {x - places.rendering.x, y - places.rendering.y});
        return;
    }
    if (pointed_camera_ && ImGui::IsMouseReleased(ImGuiMouseButton_Left) &&
        io.MouseDragMaxDistanceSqr[ImGuiMouseButton_Left] < kStillPixels * kStillPixels)
        go_to_camera(*pointed_camera_);
}

void App::go_to_camera(int frame) {
    view_.stand(dataset_view(*scene_.gaussians, *scene_.dataset, frame));
    at_camera_ = frame;
    settings_.turntable = false;
    redraw();
}

void App::go_to_nearest_camera() {
    if (!scene_.dataset) return say("there are no cameras; --cameras DATASET shows a dataset's");
    const Size size = picture_area().size();
    go_to_camera(nearest_frame(*scene_.dataset, view_.camera(size.width, size.height), view_.radius()));
}

void App::step_camera(int step) {
    if (!scene_.dataset || !at_camera_) return go_to_nearest_camera();
    const int count = int(scene_.dataset->frames.size());
    go_to_camera((*at_camera_ + step + count) % count);
}

void App::reset_view() {
    view_.reset();
    at_camera_ = start_frame_;
}

void App::show_whole_scene() {
    const Size size = picture_area().size();
    Viewpoint place = framing_view(*scene_.gaussians, scene_.dataset.get(), size.width, size.height);
    view_.stand(place);
    leave_camera();
    settings_.turntable = false;
    redraw();
}

void App::change_comparison() {
    if (!scene_.dataset) return go_to_nearest_camera();
    settings_.comparison = Comparison((int(settings_.comparison) + 1) % 4);
    if (settings_.comparison != Comparison::none && !at_camera_) go_to_nearest_camera();
}

std::vector<io::NamedView>::iterator App::find_view(size_t number) {
    return std::find_if(
        views_.begin(), views_.end(),
        [name = std::to_string(number)](const io::NamedView& view) { return view.name == name; });
}

void App::save_view(size_t number) {
    const Size size = picture_area().size();
    const std::string name = std::to_string(number);
    const io::NamedView view{name, view_.camera(size.width, size.height), view_.pivot()};
    if (const auto same = find_view(number); same != views_.end())
        *same = view;
    else
        views_.push_back(view);
    say("view " + name + " is saved; Shift + " + name + " goes to it");
}

void App::go_to_view(const io::NamedView& view) {
    view_.stand({view.camera, view.pivot, view_.up(), view_.radius()});
    leave_camera();
}

void App::go_to_number(size_t number) {
    if (const auto view = find_view(number); view != views_.end()) return go_to_view(*view);
    const std::string name = std::to_string(number);
    say("there is no view " + name + "; Ctrl + " + name + " saves one");
}

void App::write_views() {
    try {
        const std::filesystem::path file = free_name("ewa-views", ".json");
        io::write_views(file, views_);
        say("wrote " + std::filesystem::absolute(file).string() + "; --views opens it");
    } catch (const RunError& error) {
        say(error.what());
    }
}

void App::start_film() {
    Film film(views_, startup_.film.value_or(free_name("ewa-film", "")), picture_area().size(),
              double(settings_.film_seconds));
    try {
        core::make_folder(film.folder);
    } catch (const RunError& error) {
        if (startup_.film) throw;
        return say(error.what());
    }
    settings_.turntable = false;
    leave_camera();
    film_ = std::move(film);
}

/// Asks for the next frame once the last one is written.
void App::continue_film() {
    if (film_->waits_for != 0) {
        if (!renders_.shown() || renders_.shown()->request.serial < film_->waits_for) return;
        ++film_->next;
        redraw();
    }
    if (film_->finished()) {
        say("wrote " + std::to_string(film_->frames) + " pictures to " +
            std::filesystem::absolute(film_->folder).string());
        film_.reset();
        done_ = startup_.film.has_value();
        return;
    }
    view_.stand({film_->camera(), view_.pivot(), view_.up(), view_.radius()});
    film_->waits_for =
        renders_.write(view_.camera(film_->size.width, film_->size.height), settings_.look, film_->file());
}

Film::Film(const std::vector<io::NamedView>& views, const std::filesystem::path& into, Size frame_size,
           double seconds)
    : folder(into), size(frame_size) {
    for (const io::NamedView& view : views) keys.push_back(view.camera);
    frames = int((double(keys.size()) - 1) * kRate * seconds + 0.5) + 1;
}

Camera Film::camera() const {
    return along_path(keys, frames > 1 ? double(next) * double(keys.size() - 1) / (frames - 1) : 0);
}

std::filesystem::path Film::file() const {
    char name[32];
    std::snprintf(name, sizeof(name), "%05d.png", next);
    return folder / name;
}

}  // namespace ewa::viewer
